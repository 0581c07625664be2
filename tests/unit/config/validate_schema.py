"""validate_schema.py SCHEMA SOURCE_DIR: the examples pass, the broken files fail as far as a schema can tell."""
import json
import pathlib
import sys

import jsonschema
import yaml

# Only the loader can tell these: relations between keys, arithmetic, and what the YAML parser drops silently.
LOADER_ONLY = {
    "function_twice",
    "homing_without_switch",
    "jog_travel",
    "limits_beyond_counter",
    "listen_port",
    "merge_key",
    "missing_travel",
    "modulo_with_limits",
    "plaintext",
    "reversed_limits",
    "same_node",
    "same_port",
    "scale_too_fine",
    "simulate_on_real_bus",
    "simulate_without_effect",
    "start_above_velocity",
    "start_speed",
    "tag",
    "times",
    "unknown_bus",
    "velocity_too_high",
    "velocity_too_low",
    "vertical",
}
UNREADABLE = {"alias_loop", "two_documents", "syntax_bracket", "syntax_indent", "syntax_tab"}


def main():
    schema = json.loads(pathlib.Path(sys.argv[1]).read_text())
    source = pathlib.Path(sys.argv[2])
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    failures = 0
    for file in sorted(source.glob("config/examples/*.yaml")):
        for error in validator.iter_errors(yaml.safe_load(file.read_text())):
            print(f"{file.name}: refused: {list(error.absolute_path)}: {error.message[:200]}")
            failures += 1
    seen = set()
    for file in sorted(source.glob("tests/broken/*.yaml")):
        seen.add(file.stem)
        if file.stem in UNREADABLE:
            continue
        accepted = validator.is_valid(yaml.safe_load(file.read_text()))
        if accepted != (file.stem in LOADER_ONLY):
            print(f"{file.name}: {'accepted' if accepted else 'refused'} by the schema")
            failures += 1
    missing = (UNREADABLE | LOADER_ONLY) - seen
    if missing:
        print("no such files:", ", ".join(sorted(missing)))
    sys.exit(1 if failures or missing else 0)


main()
