"""Files that were made to do harm: each ends in one sentence, within seconds and in little memory."""
