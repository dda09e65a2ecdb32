"""Rules, changes that mend findings, output of findings, and the policy that filters them."""
