"""validate_schema.py SCHEMA SOURCE_DIR: the examples pass, the broken files fail as far as a schema can tell."""
import json
import pathlib
import sys

import jsonschema
import yaml

# Only the loader can tell these: relations between keys, arithmetic, and what the YAML parser drops silently.
LOADER_ONLY = {
    "baud_of_model",
    "budget",
    "canopen_answers",
    "canopen_models",
    "device_nodes",
    "device_same_address",
    "empty_range",
    "function_twice",
    "function_twice_inverted",
    "group_axes",
    "home_approach",
    "homing_number",
    "homing_without_switch",
    "jog_travel",
    "limit_homing_without_switch",
    "lease_ttl",
    "limits_beyond_counter",
    "listen_port",
    "merge_key",
    "metrics",
    "metrics_at_listen",
    "metrics_at_stop_listen",
    "metrics_at_stops",
    "model_on_wrong_bus",
    "missing_travel",
    "misspelt_unit",
    "modulo_with_limits",
    "plaintext",
    "pv_direction",
    "reversed_limits",
    "same_interface",
    "same_node",
    "same_port",
    "scale_too_fine",
    "segment_selection",
    "segment_targets",
    "segment_times",
    "segment_values",
    "segments_mode",
    "simulate_on_real_bus",
    "simulate_power_on_can",
    "simulate_units",
    "simulate_without_effect",
    "start_above_velocity",
    "start_speed",
    "tag",
    "times",
    "too_many_can_drives",
    "too_many_drives",
    "unit_of_nothing",
    "unknown_bus",
    "velocity_too_high",
    "velocity_too_low",
    "vertical",
}
UNREADABLE = {"alias_loop", "brace_too_many", "two_documents", "syntax_bracket", "syntax_indent", "syntax_tab"}


def as_json(value, done):
    """Numbers that are keys become strings, as in JSON. Aliases stay shared: some files multiply them."""
    if id(value) not in done:
        if isinstance(value, dict):
            done[id(value)] = {str(key): as_json(item, done) for key, item in value.items()}
        elif isinstance(value, list):
            done[id(value)] = [as_json(item, done) for item in value]
        else:
            return value
    return done[id(value)]


def load(file):
    return as_json(yaml.safe_load(file.read_text()), {})


def main():
    schema = json.loads(pathlib.Path(sys.argv[1]).read_text())
    source = pathlib.Path(sys.argv[2])
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    failures = 0
    for file in sorted(source.glob("config/examples/*.yaml")):
        for error in validator.iter_errors(load(file)):
            print(f"{file.name}: refused: {list(error.absolute_path)}: {error.message[:200]}")
            failures += 1
    seen = set()
    for file in sorted(source.glob("tests/broken/*.yaml")):
        seen.add(file.stem)
        if file.stem in UNREADABLE:
            continue
        accepted = validator.is_valid(load(file))
        if accepted != (file.stem in LOADER_ONLY):
            print(f"{file.name}: {'accepted' if accepted else 'refused'} by the schema")
            failures += 1
    missing = (UNREADABLE | LOADER_ONLY) - seen
    if missing:
        print("no such files:", ", ".join(sorted(missing)))
    sys.exit(1 if failures or missing else 0)


main()
