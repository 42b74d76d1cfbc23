"""`make mutants`: makes one small change at a time in the sources, and checks that tests notice."""
