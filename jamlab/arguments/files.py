"""Options and arguments that say which files and tables are written."""

from jamlab.arguments.argument import Argument

FILES = (
    Argument("out", "File to write.", "path", short="o", habits="save output out_csv html"),
    Argument(
        "overwrite", "Replace existing files.", "flag", default=False, habits="force exist_ok clobber yes replace"
    ),
    Argument("csv", "Table of all rows to write (.csv).", "path", default=None, unset="none is written"),
    Argument("plot", "Picture to write (.png, .pdf, .svg).", "path", default=None, unset="none is written"),
    Argument("json", "Print one JSON object instead of a table.", "flag", default=False, habits="as_json"),
    Argument("file", "File of packings, outlines or pictures.", "path"),
    Argument("files", "Files of packings.", "path"),
    Argument("target", "File to write.", "path"),
    Argument(
        "folder",
        "Folder for files.",
        "path",
        default=None,
        unset="beside the campaign file, under its name",
        otherwise={"jamlab demo": "jamlab-demo"},
    ),
    Argument("copy", "Folder to which all decks and parts are copied.", "path", default=None, unset="none is copied"),
    Argument("dry_run", "Say what would be done; do nothing.", "flag", default=False),
)
