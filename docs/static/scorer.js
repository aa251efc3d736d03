// Order of search results: pages of definitions before others, the gallery and pages of lists last.
const PAGES_FIRST = [
  ["explanation/terms", 25],
  ["explanation/quantities", 20],
  ["explanation/units", 12],
  ["explanation/", 6],
  ["how_to/", 4],
  ["gallery/", -3],
  ["reference/arguments", -3],
  ["reference/commands", -3],
];
var Scorer = {
  score: result => {
    const [docname, , , , score] = result;
    const found = PAGES_FIRST.find(([start]) => docname.startsWith(start));
    return score + (found ? found[1] : 0);
  },
  objNameMatch: 30, // the whole name: its page comes first
  objPartialMatch: 6,
  objPrio: {0: 15, 1: 5, 2: -5},
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
