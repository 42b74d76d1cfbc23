"""Tests of containers and files of other libraries."""
