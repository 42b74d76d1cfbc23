"""What holds beyond the tests: limits, boards, and whether the tests would notice a fault."""
