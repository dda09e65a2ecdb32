"""The grasper that the sensor lies in: its jaws, how they close, what is behind them, how board and tail lie there."""
