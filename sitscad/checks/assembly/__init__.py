"""SIT3xx: whether pad, target and sensor turn force into signal, and fit the jaw."""
