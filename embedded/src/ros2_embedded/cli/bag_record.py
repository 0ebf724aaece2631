"""`ros2 bag record`: its options."""

from __future__ import annotations

import argparse
import datetime
import os
from pathlib import Path

from ros2_embedded.cli.bag_recorder import Choice, Recording
from ros2_embedded.cli.common import Define, exclusive, flag, option, whole


def _list(name: str, metavar: str, text: str) -> Define:
    return option(name, default=[], metavar=metavar, nargs="+", help=text)


OPTIONS = (
    option("-o", "--output",
           help="Destination of the bagfile to create, defaults to a timestamped folder in the "
           "current directory."),
    option("-s", "--storage", default="mcap", choices=["mcap"],
           help="Storage identifier to be used, defaults to '%(default)s'."),
    exclusive(
        option("topics_positional", default=[], metavar="[Topic ...]", nargs="*",
               help="Space-delimited list of topics to record. (deprecated)"),
        _list("--topics", "Topic", "Space-delimited list of topics to record."),
    ),
    _list("--topic-types", "TopicType", "Space-delimited list of topic types to record."),
    _list("--exclude-topic-types", "ExcludeTopicTypes",
          "Space-delimited list of topic types not being recorded. Works on top of --all, "
          "--all-topics, --topics or --regex."),
    _list("--exclude-topics", "Topic",
          "Space-delimited list of topics not being recorded. Works on top of --all, "
          "--all-topics, --topics or --regex."),
    flag("-a", "--all", text="Record all topics and services (Exclude hidden topic)."),
    flag("--all-topics", text="Record all topics (Exclude hidden topic)."),
    option("-e", "--regex", default="",
           help="Record only topics and services containing provided regular expression. Note:  "
           "--all, --all-topics or --all-services will override --regex."),
    option("--exclude-regex", default="",
           help="Exclude topics and services containing provided regular expression. Works on top "
           "of --all, --all-topics, --all-services, --topics, --services or --regex."),
    flag("--include-unpublished-topics",
         text="Discover and record topics which have no publisher. Subscriptions on such topics "
         "will be made with default QoS unless otherwise specified in a QoS overrides file."),
    flag("--include-hidden-topics",
         text="Discover and record hidden topics as well. These are topics used internally by "
         "ROS 2 implementation."),
    flag("--no-discovery",
         text="Disables topic auto discovery during recording: only topics present at startup "
         "will be recorded."),
    flag("--ignore-leaf-topics", text="Ignore topics without a subscription."),
    flag("--disable-keyboard-controls", text="disables keyboard controls for recorder"),
    flag("--use-sim-time",
         text="Use simulation time for message timestamps by subscribing to the /clock topic. "
         "Until first /clock message is received, no messages will be written to bag."),
    option("-p", "--polling-interval", type=whole, default=100,
           help="Time in ms to wait between querying available topics for recording. It has no "
           "effect if --no-discovery is enabled."),
    option("--node-name", default="rosbag2_recorder",
           help="Specify the recorder node name. Default is %(default)s."),
    option("--custom-data", default=[], metavar="KEY=VALUE", nargs="*",
           help="Space-delimited list of key=value pairs. Store the custom data in metadata under "
           'the "rosbag2_bagfile_information/custom_data". The key=value pair can appear more than '
           "once. The last value will override the former ones."),
    option("--storage-preset-profile", default="none",
           choices=["none", "fastwrite", "zstd_fast", "zstd_small"],
           help='Select a preset configuration for storage plugin "mcap".'),
)  # fmt: skip


def _error(text: str) -> str:
    return f"[ERROR] [ros2bag]: {text}"


def _refusal(options: argparse.Namespace, folder: str) -> str | None:
    """The error in the options; None if there is no error."""
    every = options.all or options.all_topics
    if not (every or options.topics or options.topic_types or options.regex):
        return _error(
            "Need to specify at least one option out of --all, --all-topics, --all-services, "
            "--services, --topics, --topic-types or --regex"
        )
    by_rule = every or options.topic_types or options.regex
    if options.exclude_regex and not by_rule:
        return _error(
            "--exclude-regex argument requires either --all, --all-topics, --topic-types, "
            "--all-services or --regex"
        )
    if options.exclude_topics and not by_rule:
        return _error(
            "--exclude-topics argument requires either --all, --all-topics, --topic-types or "
            "--regex"
        )
    if options.exclude_topic_types and not by_rule:
        return _error(
            "--exclude-topic-types argument requires either --all, --all-topics or --regex"
        )
    if every and options.topics:
        print("[WARN] [ros2bag]: --all or --all-topics will override --topics")
    if every and options.regex:
        print(
            "[WARN] [ros2bag]: --all, --all-topics or --all-services will override --regex"
        )  # fmt: skip
    if os.path.isdir(folder):
        return _error(f"Output folder '{folder}' already exists.")
    if options.use_sim_time and options.no_discovery:
        return _error(
            "--use-sim-time and --no-discovery both set, but are incompatible settings. The "
            "/clock topic needs to be discovered to record with sim time."
        )
    return None


def record(options: argparse.Namespace) -> str | None:
    """Records until Ctrl-C or SIGTERM; returns what went wrong."""
    folder = options.output or datetime.datetime.now().strftime("rosbag2_%Y_%m_%d-%H_%M_%S")
    options.topics = options.topics_positional or options.topics
    refusal = _refusal(options, folder)
    if refusal is not None:
        return refusal
    choice = Choice(
        every=options.all or options.all_topics,
        topics=[topic if topic.startswith("/") else f"/{topic}" for topic in options.topics],
        types=options.topic_types,
        regex=options.regex,
        hidden=options.include_hidden_topics,
        unpublished=options.include_unpublished_topics,
        unheard=not options.ignore_leaf_topics,
        without_topics=options.exclude_topics,
        without_types=options.exclude_topic_types,
        without_regex=options.exclude_regex,
    )
    Recording(
        Path(folder),
        choice,
        compress=options.storage_preset_profile.startswith("zstd"),
        custom_data=dict(pair.split("=", 1) for pair in options.custom_data),
        name=options.node_name,
        poll=None if options.no_discovery else options.polling_interval * 1e-3,
        use_sim_time=options.use_sim_time,
    ).run()
    return None
