#include "tape.hpp"

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
class Player {
 public:
  explicit Player(report::Renderer& renderer) : renderer_(&renderer) {}

  Result<void> play(const Tape::Entry& entry) {
    return std::visit(
        Overloaded{
            [&](const report::Record& record) { return renderer_->record(record); },
            [&](const Tape::Line& line) { return renderer_->line(line.record, line.plain); },
            [&](const std::string& note) {
              if (told_.insert(note).second) renderer_->note(note);
              return Result<void>();
            },
            [&](const Tape::Fault& fault) { return renderer_->error(fault.error, fault.time); }},
        entry);
  }

 private:
  report::Renderer* renderer_;
  std::set<std::string> told_ = {};
};

/// Lists with the same place on their tapes; the columns are those of any tape that has them.
Result<void> play_section(std::span<const Tape* const> tapes, std::size_t place, Player& player,
                          report::Renderer& renderer) {
  std::vector<report::Column> columns;
  for (const Tape* tape : tapes) {
    if (place < tape->sections().size() && columns.empty())
      columns = tape->sections()[place].columns;
  }
  Result<void> played;
  if (!columns.empty()) played = renderer.begin(with_target(columns));
  for (const Tape* tape : tapes) {
    if (place >= tape->sections().size()) continue;
    for (const Tape::Entry& entry : tape->sections()[place].entries) {
      if (played) played = player.play(entry);
    }
  }
  return played && !columns.empty() ? renderer.end() : played;
}

}  // namespace

Result<void> Tape::begin(std::span<const report::Column> columns) {
  if (!sections_.back().columns.empty()) sections_.emplace_back();
  sections_.back().columns.assign(columns.begin(), columns.end());
  return {};
}

Result<void> Tape::record(const report::Record& record) {
  sections_.back().entries.emplace_back(record);
  return {};
}

Result<void> Tape::line(const report::Record& record, std::string_view plain) {
  sections_.back().entries.emplace_back(Line{record, std::string(plain)});
  return {};
}

void Tape::note(std::string_view sentence) {
  sections_.back().entries.emplace_back(std::string(sentence));
}

Result<void> Tape::summary(const report::Record& record, std::string_view sentence) {
  summaries_.push_back({record, std::string(sentence)});
  return {};
}

Result<void> Tape::error(const Error& error, WallTime time) {
  sections_.back().entries.emplace_back(Fault{error, time});
  return {};
}

std::vector<report::Column> with_target(std::span<const report::Column> columns) {
  std::vector<report::Column> all = {{"TARGET", "target"}};
  all.insert(all.end(), columns.begin(), columns.end());
  return all;
}

Result<void> play(std::span<const Tape* const> tapes, report::Renderer& renderer) {
  std::size_t sections = 0;
  for (const Tape* tape : tapes) sections = std::max(sections, tape->sections().size());
  Player player(renderer);
  Result<void> played;
  for (std::size_t place = 0; played && place < sections; ++place) {
    played = play_section(tapes, place, player, renderer);
  }
  for (const Tape* tape : tapes) {
    for (const Tape::Line& summary : tape->summaries()) {
      if (!played) return played;
      played = renderer.summary(summary.record,
                                fmt::format("{}: {}", summary.record.target, summary.plain));
    }
  }
  return played;
}

}  // namespace spindle::commands
