"""Effect of a finite target, and of a window in the jaw, on the coils."""
