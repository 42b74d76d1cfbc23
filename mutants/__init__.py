"""`make mutants`: breaks the sources one small change at a time, and asks the tests to notice."""
