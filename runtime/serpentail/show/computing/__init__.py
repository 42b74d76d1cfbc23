"""What a page needs to compute a run again: the model's C as WebAssembly, its memory, its knobs."""
