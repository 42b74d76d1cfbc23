"""Tests of pictures, pages and live views."""
