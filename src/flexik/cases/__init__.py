"""What is particular to each published work; `case` states what every case gives."""
