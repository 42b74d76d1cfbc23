"""Output languages: programs go in, the text of one language comes out."""
