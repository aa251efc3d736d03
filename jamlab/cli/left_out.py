"""Arguments of public functions that are no options of the commands which call them, each with its reason.

A test compares these with the signatures: whatever a function takes is an option by its name, or stands here.
"""

BY_WORDS = {  # of every function: what stands for it in the shell
    **dict.fromkeys(("packing", "packings", "flow", "outlines", "picture", "source"), "FILE or FILES"),
    "path": "FILE, CAMPAIGN or --out",
    "progress": "commands always show their progress, on stderr",
    "omega": "--omega-min, --omega-max and --points, where several frequencies are asked for",
}
LEFT_OUT = {  # function and argument -> reason
    **dict.fromkeys(("Campaign.run.done", "Campaign.cluster.tell"), "failures and messages are printed"),
    **dict.fromkeys(
        ("droplets_from_outlines.free_areas", "droplets_from_outlines.rest_areas"), "columns of the table of outlines"
    ),
    **dict.fromkeys(("write_page.observables", "write.observables"), "those that the file holds"),
    "mean_spectra.select": "rows of a campaign, which are chosen in Python; the command reads packings",
}
