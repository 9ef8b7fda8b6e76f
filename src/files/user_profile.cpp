#include "spindle/files/user_profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "files/yaml_text.hpp"
#include "spindle/base/text.hpp"

namespace spindle::files {
namespace {

// Lines of comments end here.
constexpr std::size_t longest_line = 98;

/// Words behind '#', line by line; no character of a tool's own texts ends a comment.
std::string comment(std::string_view indent, const std::string& sentence) {
  std::string text;
  std::string line = fmt::format("{}#", indent);
  for (const std::string_view word : split(sentence, ' ')) {
    std::string plain;
    for (const char c : word) plain += c < ' ' || c > '~' ? '?' : c;
    if (line.size() + 1 + plain.size() > longest_line) {
      text += line + "\n";
      line = fmt::format("{}#", indent);
    }
    line += " " + plain;
  }
  return text + line + "\n";
}

/// What may be given, as the action has it.
std::string values_of(const SeenOnTool::Action& action) {
  const catalogue::LearnedAction& what = action.what;
  if (what.by == catalogue::LearnedBy::clearing) return fmt::format("value: {}", action.value);
  if (what.labels.empty()) return fmt::format("range: {}..{}", what.minimum, what.maximum);
  std::vector<std::string> labels;
  for (const catalogue::Label& label : what.labels) {
    labels.push_back(fmt::format("{}: {}", label.number, quoted(label.text)));
  }
  return fmt::format("labels: {{{}}}", fmt::join(labels, ", "));
}

/// A value proves itself by the parameter that it was seen to follow.
std::string confirmation_of(const catalogue::LearnedAction& what) {
  const bool clears = what.by == catalogue::LearnedBy::clearing;
  return fmt::format("confirm: {}{}", what.follows, clears ? "\n    confirm-value: 0" : "");
}

}  // namespace

std::string render_user_profile(const SeenOnTool& seen) {
  std::string text =
      comment("", fmt::format("What was seen on a tool of one's own: {}.", seen.seen));
  text += fmt::format("format: 1\nid: {}\nextends: {}\ntitle: {}\n", seen.id, seen.extends,
                      quoted(fmt::format("{} and what a tool of one's own showed", seen.extends)));
  if (seen.event_block) {
    text += "events:\n";
    for (const std::string& remark : seen.remarks) text += comment("  ", remark);
    text += fmt::format("  first: {}  # evidence: verified\n", *seen.event_block);
  }
  if (seen.action) {
    const catalogue::LearnedAction& what = seen.action->what;
    text += "actions:\n";
    for (const std::string& remark : seen.remarks) text += comment("  ", remark);
    text += fmt::format(
        "  - name: {}\n    title: {}\n    register: {}\n    {}\n    hazard: {}\n    evidence: "
        "verified\n    source: {}\n    {}\n    check: {}\n",
        what.name, quoted(what.title), seen.action->address, values_of(*seen.action),
        catalogue::hazard_words.text(what.hazard), quoted(seen.seen), confirmation_of(what),
        quoted(what.check));
  }
  return text;
}

}  // namespace spindle::files
