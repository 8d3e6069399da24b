"""Figures of `pickleflight lab terms` as texts, for its chart and its report."""


def saved_text(row):
    """The share of the cost that a flight without the term saves, or that the runs do not resolve it."""
    if row["saved_share"] is None:
        return "timed on another machine"
    saved, sigma = 100 * row["saved_share"], 100 * row.get("saved_share_sigma", 0.0)
    if sigma == 0.0:  # one flight was timed, or an earlier program measured none
        return f"{saved:.0f} %"
    return f"{saved:.0f} \u00b1 {sigma:.0f} %" if abs(saved) >= 2 * sigma else f"not resolved (\u00b1 {2 * sigma:.0f} %)"
