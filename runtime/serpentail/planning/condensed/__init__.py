"""Programs of stages, each of which solves its collocation inside, for FATROP."""
