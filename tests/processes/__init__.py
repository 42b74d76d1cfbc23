"""Tests of the runtime in children, pools and threads, and of what Ctrl-C leaves."""
