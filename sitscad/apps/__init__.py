"""What uses all of it: studies, boards on the bench, the page that follows a spec while it is edited."""
