#include "spindle/commands/metrics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string_view>

#include "spindle/base/utf8.hpp"
#include "spindle/catalogue/profile.hpp"

namespace spindle::commands {
namespace {

/// A monitoring system keeps every reason for ever.
constexpr std::size_t most_reasons = 16;

struct Label {
  std::string_view name;
  std::string_view value;
};

/// A value between quotes: backslash, quote and line feed are escaped, and all of it is UTF-8.
std::string escaped(std::string_view value) {
  std::string text;
  while (!value.empty()) {
    const CodePoint first = first_code_point(value);
    if (first.value == U'\\' || first.value == U'"') text += '\\';
    if (first.value == U'\n') {
      text += "\\n";
    } else {
      append_first(text, first, value);
    }
    value.remove_prefix(first.length);
  }
  return text;
}

/// The lines of one metric, whose head stands once in front of them.
class Family {
 public:
  Family(std::string& text, std::string_view name, std::string_view type, std::string_view help)
      : text_(&text), name_(name), type_(type), help_(help) {}

  void add(const std::vector<Label>& labels, std::string_view value, std::string_view suffix = {}) {
    if (!begun_) {
      *text_ += fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n", name_, help_, type_);
    }
    begun_ = true;
    *text_ += fmt::format("{}{}", name_, suffix);
    std::string_view separator = "{";
    for (const Label& label : labels) {
      *text_ += fmt::format("{}{}=\"{}\"", separator, label.name, escaped(label.value));
      separator = ",";
    }
    *text_ += fmt::format("{}{}\n", labels.empty() ? " " : "} ", value);
  }
  void add(const std::vector<Label>& labels, std::uint64_t value) {
    add(labels, fmt::format("{}", value));
  }

 private:
  std::string* text_;
  std::string_view name_;
  std::string_view type_;
  std::string_view help_;
  bool begun_ = false;
};

/// Seconds without rounding.
std::string seconds(Duration duration) {
  return fmt::format("{}.{:09}", duration.count() / 1'000'000'000,
                     duration.count() % 1'000'000'000);
}

void add_results(const Metrics& metrics, std::string& text) {
  Family results(text, "spindle_results_total", "counter",
                 "Fastening results in the store, by preset and by what the tool made of them.");
  for (const auto& [labels, count] : metrics.results) {
    results.add({{"tool", labels.tool}, {"preset", labels.preset}, {"result", labels.result}},
                count);
  }
  Family missed(text, "spindle_missed_results_total", "counter",
                "Events of a tool that are known to be missing in the store.");
  for (const auto& [tool, count] : metrics.missed) missed.add({{"tool", tool}}, count);
  Family gaps(text, "spindle_gaps_total", "counter",
              "Gaps in the events of a tool, also those of unknown size, by reason.");
  for (const auto& [labels, count] : metrics.gaps) {
    gaps.add({{"tool", labels.first}, {"reason", labels.second}}, count);
  }
}

void add_tools(const Metrics& metrics, std::string& text) {
  Family links(text, "spindle_link_up", "gauge", "Whether a tool is connected (1) or not (0).");
  for (const auto& [tool, is_up] : metrics.links) links.add({{"tool", tool}}, is_up ? "1" : "0");
  Family last(text, "spindle_last_result_timestamp_seconds", "gauge",
              "When the last fastening result of a tool was heard, in seconds since 1970.");
  for (const auto& [tool, at] : metrics.last_results) {
    last.add({{"tool", tool}}, seconds(at.time_since_epoch()));
  }
}

void add_store(const Metrics& metrics, std::string& text) {
  if (metrics.commits) {
    Family commits(text, "spindle_store_commit_seconds", "histogram",
                   "How long transactions of the store took that were durable.");
    for (std::size_t index = 0; index < Histogram::limits.size(); ++index) {
      const std::string limit = fmt::format("{}", Histogram::limits[index]);
      commits.add({{"le", limit}}, fmt::format("{}", metrics.commits->up_to(index)), "_bucket");
    }
    const std::string count = fmt::format("{}", metrics.commits->count());
    commits.add({{"le", "+Inf"}}, count, "_bucket");
    commits.add({}, seconds(metrics.commits->sum()), "_sum");
    commits.add({}, count, "_count");
  }
  if (metrics.store_bytes) {
    Family(text, "spindle_store_bytes", "gauge", "Size of the store without its log.")
        .add({}, *metrics.store_bytes);
  }
  if (metrics.pending) {
    Family(text, "spindle_store_pending", "gauge", "Records that wait to be stored.")
        .add({}, *metrics.pending);
  }
}

void add_sinks(const Metrics& metrics, std::string& text) {
  Family backlog(text, "spindle_sink_backlog", "gauge", "Events that a sink has not got yet.");
  for (const SinkMetrics& sink : metrics.sinks) backlog.add({{"sink", sink.name}}, sink.backlog);
  Family oldest(text, "spindle_sink_oldest_seconds", "gauge",
                "Age of the oldest event that a sink has not got yet; 0 where it has all.");
  for (const SinkMetrics& sink : metrics.sinks) {
    oldest.add({{"sink", sink.name}}, seconds(sink.oldest.value_or(Duration::zero())));
  }
  Family delivered(text, "spindle_sink_delivered_total", "counter",
                   "Events that a sink has acknowledged.");
  for (const SinkMetrics& sink : metrics.sinks) {
    if (sink.delivered) delivered.add({{"sink", sink.name}}, *sink.delivered);
  }
  Family errors(text, "spindle_sink_errors_total", "counter",
                "Deliveries that a sink refused or that did not reach it, by reason.");
  for (const SinkMetrics& sink : metrics.sinks) {
    for (const auto& [reason, count] : sink.errors) {
      errors.add({{"sink", sink.name}, {"reason", reason}}, count);
    }
  }
}

}  // namespace

void Histogram::add(Duration took) {
  const double measured = std::chrono::duration<double>(took).count();
  const auto limit =
      std::find_if(limits.begin(), limits.end(), [&](double each) { return measured <= each; });
  if (limit != limits.end()) ++counts_[static_cast<std::size_t>(limit - limits.begin())];
  ++count_;
  sum_ += took;
}

std::uint64_t Histogram::up_to(std::size_t index) const {
  std::uint64_t sum = 0;
  for (std::size_t at = 0; at <= index; ++at) sum += counts_[at];
  return sum;
}

void Metrics::count_event(const std::string& tool, std::string_view kind,
                          std::optional<std::int64_t> preset, WallTime at) {
  const bool is_ok = kind == catalogue::event_kind_words.text(catalogue::EventKind::fastening_ok);
  const bool is_ng = kind == catalogue::event_kind_words.text(catalogue::EventKind::fastening_ng);
  if (!is_ok && !is_ng) return;
  ++results[{tool, preset ? fmt::format("{}", *preset) : "unknown", is_ok ? "ok" : "ng"}];
  WallTime& last = last_results[tool];
  last = std::max(last, at);
}

void Metrics::count_gap(const std::string& tool, const store::Gap& gap) {
  missed[tool] += gap.missed.value_or(0);
  const auto known = gaps.find({tool, gap.reason});
  if (known != gaps.end()) {
    ++known->second;
    return;
  }
  const auto reasons = std::count_if(gaps.begin(), gaps.end(),
                                     [&](const auto& each) { return each.first.first == tool; });
  const bool is_full = static_cast<std::size_t>(reasons) >= most_reasons;
  ++gaps[{tool, is_full ? "other" : gap.reason}];
}

std::string to_prometheus(const Metrics& metrics) {
  std::string text;
  add_results(metrics, text);
  add_tools(metrics, text);
  add_store(metrics, text);
  add_sinks(metrics, text);
  Family(text, "spindle_build_info", "gauge", "The version of spindle, as a label.")
      .add({{"version", metrics.version}}, "1");
  return text;
}

}  // namespace spindle::commands
