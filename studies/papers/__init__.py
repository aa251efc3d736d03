"""Numbers and figures of Boromand et al. and of Baumgarten & Tighe, beside ours."""
