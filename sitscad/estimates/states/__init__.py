"""What is round the coils in each state: target, jaw and shield, and the pad under force."""
