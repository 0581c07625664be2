"""Opens a raw CAN socket and becomes slave.js, which cannot: slave.py INTERFACE, and the arguments of slave.js but the first."""
import os
import pathlib
import socket
import sys

can = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
can.bind((sys.argv[1],))
can.set_inheritable(True)
script = pathlib.Path(__file__).with_name("slave.js")
os.execvp("node", ["node", str(script), str(can.fileno()), *sys.argv[2:]])
