"""`make mutants` tells whether the tests would notice a fault."""
