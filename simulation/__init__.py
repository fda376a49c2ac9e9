"""People and objects that move, the task of the paper, minimum distances, and whether a person is
detected in time.
"""
