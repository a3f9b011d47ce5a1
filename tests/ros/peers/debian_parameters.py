"""What Debian's parameter server makes of the operations on standard input: a JSON list, answered by one."""

import copy
import json
import sys

from rosmaster.paramserver import ParamDictionary

parameters = ParamDictionary(None)
answers = []
for operation, *arguments in json.load(sys.stdin):
    try:
        if operation == "set":
            answers.append(parameters.set_param(*arguments))
        elif operation == "get":
            answers.append(copy.deepcopy(parameters.get_param(*arguments)))
        elif operation == "has":
            answers.append(parameters.has_param(*arguments))
        elif operation == "delete":
            answers.append(parameters.delete_param(*arguments))
        elif operation == "search":
            answers.append(parameters.search_param(*arguments))
        else:
            answers.append(sorted(parameters.get_param_names()))
    except (KeyError, TypeError):  # it lets out a TypeError for what lies below a value
        answers.append("KeyError")
json.dump(answers, sys.stdout)
