"""``heli look``: what logs can tell of the plant, before they are diagnosed."""

from heli_identifier.cli.options import Config, From, Json, Logs, To


def look(logs: Logs, start: From = None, end: To = None, config: Config = None, json: Json = False) -> None:
    """Look at the logs of one rig: who flew, what moved, which gains these logs determine, what to fly next.

    Gains are slopes at the logs' mean voltage. References in the logs, or rebuilt from the voltages, judge them.
    """
    from heli_identifier.cli.logs import found_configuration, print_notes
    from heli_identifier.cli.terminal import note, print_json, print_table
    from heli_identifier.records import read_logs
    from heli_identifier.results import look as look_at

    configuration = found_configuration(config)
    recorded = read_logs(logs, configuration.format, start, end)
    print_notes(recorded)
    found = look_at(recorded, configuration=configuration)
    if json:
        print_json(found.to_dict())
        return
    print_table(found.title, found.columns, found.rows)
    for text in found.remarks:
        note(text)
