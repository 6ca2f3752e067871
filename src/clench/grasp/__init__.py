"""The method, one file per step: planes, sections, contacts, candidates, feasibility, choice."""
