"""What several tests use: generated models, programs, starts, toolchains."""
