"""Arguments of functions, options, campaign files and decks: what each is, once."""
