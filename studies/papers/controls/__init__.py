"""Controls of estimators: data of the law that a paper states go through the analysis that measures its number."""
