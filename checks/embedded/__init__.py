"""Models on microcontrollers, in emulators."""
