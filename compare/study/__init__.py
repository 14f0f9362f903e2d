"""Studies: many runs of one scene, as a resumable workflow; what they say is drawn by
compare/charts/study.
"""
