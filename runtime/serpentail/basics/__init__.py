"""What every room uses: errors, checks of values, files, progress, attitudes."""
