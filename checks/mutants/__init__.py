"""`make mutants`: would the tests notice a fault?"""
