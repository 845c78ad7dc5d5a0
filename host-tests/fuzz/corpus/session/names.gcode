M550 P"robs-lineus"
M550
M587 S"a""b" P"c d"
M588 S"*"
M997
