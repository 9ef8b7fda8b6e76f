#include "recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace spindle::commands {
namespace {

template <typename... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <typename... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

/// Shows entries and remembers what need not be said again.
class Replayer {
 public:
  explicit Replayer(report::Renderer& renderer) : renderer_(&renderer) {}

  Result<void> replay(const RecordingRenderer::Entry& entry) {
    return std::visit(
        Overloaded{[&](const report::Record& record) { return renderer_->record(record); },
                   [&](const RecordingRenderer::Line& line) {
                     return renderer_->line(line.record, line.plain);
                   },
                   [&](const std::string& note) {
                     if (told_.insert(note).second) renderer_->note(note);
                     return Result<void>();
                   },
                   [&](const RecordingRenderer::Fault& fault) {
                     return renderer_->error(fault.error, fault.time);
                   }},
        entry);
  }

 private:
  report::Renderer* renderer_;
  std::set<std::string> told_ = {};
};

/// Lists with the same place on their recordings; the columns are those of any recording that has
/// them.
Result<void> replay_section(std::span<const RecordingRenderer* const> recordings, std::size_t place,
                            Replayer& replayer, report::Renderer& renderer) {
  std::vector<report::Column> columns;
  for (const RecordingRenderer* recording : recordings) {
    if (place < recording->sections().size() && columns.empty())
      columns = recording->sections()[place].columns;
  }
  Result<void> drawn;
  if (!columns.empty()) drawn = renderer.begin(with_target_column(columns));
  for (const RecordingRenderer* recording : recordings) {
    if (place >= recording->sections().size()) continue;
    for (const RecordingRenderer::Entry& entry : recording->sections()[place].entries) {
      if (drawn) drawn = replayer.replay(entry);
    }
  }
  return drawn && !columns.empty() ? renderer.end() : drawn;
}

}  // namespace

Result<void> RecordingRenderer::begin(std::span<const report::Column> columns) {
  if (!sections_.back().columns.empty()) sections_.emplace_back();
  sections_.back().columns.assign(columns.begin(), columns.end());
  return {};
}

Result<void> RecordingRenderer::record(const report::Record& record) {
  sections_.back().entries.emplace_back(record);
  return {};
}

Result<void> RecordingRenderer::line(const report::Record& record, std::string_view plain) {
  sections_.back().entries.emplace_back(Line{record, std::string(plain)});
  return {};
}

void RecordingRenderer::note(std::string_view sentence) {
  sections_.back().entries.emplace_back(std::string(sentence));
}

Result<void> RecordingRenderer::summary(const report::Record& record, std::string_view sentence) {
  summaries_.push_back({record, std::string(sentence)});
  return {};
}

Result<void> RecordingRenderer::error(const Error& error, WallTime time) {
  sections_.back().entries.emplace_back(Fault{error, time});
  return {};
}

std::vector<report::Column> with_target_column(std::span<const report::Column> columns) {
  std::vector<report::Column> all(columns.begin(), columns.end());
  const auto known = std::find_if(all.begin(), all.end(),
                                  [](const report::Column& one) { return one.key == "target"; });
  if (known == all.end()) {
    all.insert(all.begin(), {"TARGET", "target"});
  } else {
    known->room.shown = report::Shown::always;
  }
  return all;
}

Result<void> tell_under_name(const RecordingRenderer::Line& summary, report::Renderer& renderer) {
  return renderer.summary(summary.record,
                          fmt::format("{}: {}", summary.record.target, summary.plain));
}

Result<void> replay(std::span<const RecordingRenderer* const> recordings,
                    report::Renderer& renderer) {
  std::size_t sections = 0;
  for (const RecordingRenderer* recording : recordings)
    sections = std::max(sections, recording->sections().size());
  Replayer replayer(renderer);
  Result<void> drawn;
  for (std::size_t place = 0; drawn && place < sections; ++place) {
    drawn = replay_section(recordings, place, replayer, renderer);
  }
  for (const RecordingRenderer* recording : recordings) {
    for (const RecordingRenderer::Line& summary : recording->summaries()) {
      if (!drawn) return drawn;
      drawn = tell_under_name(summary, renderer);
    }
  }
  return drawn;
}

}  // namespace spindle::commands
