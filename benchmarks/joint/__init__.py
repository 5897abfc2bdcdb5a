"""A joint selection of effects by prediction errors, tried on dealt logs (`python -m benchmarks.deals`).

It is no part of a diagnosis: on measured rigs what it names still changes with the logs that are dealt.
"""
