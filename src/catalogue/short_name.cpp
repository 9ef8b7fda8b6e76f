#include "spindle/catalogue/short_name.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::catalogue {
namespace {

/// Names that a part of one may stand for.
struct Candidates {
  std::vector<std::string> beginning = {};
  std::vector<std::string> ending = {};

  [[nodiscard]] std::vector<std::string> all() const {
    std::vector<std::string> names = beginning;
    for (const std::string& name : ending) {
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    return names;
  }
};

/// Whether it can only mean what it says.
bool is_whole(std::string_view typed, const Profile& profile) {
  return typed.empty() || typed.front() == '@' || is_pattern(typed) ||
         profile.describe({std::string(typed)}).has_value();
}

Candidates candidates_for(std::string_view typed, const Profile& profile) {
  Candidates found;
  const std::string begins = fmt::format("{}.", typed);
  const std::string ends = fmt::format(".{}", typed);
  for (const Parameter& parameter : profile.parameters) {
    const std::string_view name = parameter.name;
    const bool has_either = name.starts_with(begins) || name.ends_with(ends);
    if (!has_either || profile.consumes(parameter)) continue;
    (name.starts_with(begins) ? found.beginning : found.ending).emplace_back(name);
  }
  return found;
}

Error ambiguous(std::string_view typed, const Candidates& candidates, std::string pattern) {
  const auto names = candidates.all();
  return {.code = Errc::unknown_name,
          .message = fmt::format("it may mean {} parameters", names.size()),
          .hint = "write more of the name",
          .name = std::string(typed),
          .remedy = {.right = fmt::format("spindle get TARGET {}", shell_word(pattern))},
          .details = {fmt::format("{}", fmt::join(names, ", "))}};
}

}  // namespace

Result<std::string> meant_by(std::string_view typed, const Profile& profile) {
  if (is_whole(typed, profile)) return std::string(typed);
  const Candidates candidates = candidates_for(typed, profile);
  const auto& [beginning, ending] = candidates;
  if (!beginning.empty()) return fmt::format("{}.*", typed);
  if (ending.size() == 1) return ending.front();
  if (ending.empty()) return std::string(typed);
  return tl::unexpected(ambiguous(typed, candidates, fmt::format("*.{}", typed)));
}

Result<std::vector<std::string>> meant_by(const std::vector<std::string>& typed,
                                          const Profile& profile) {
  std::vector<std::string> names;
  for (const std::string& one : typed) {
    TRY_LET(auto name, meant_by(std::string_view(one), profile));
    names.push_back(std::move(name));
  }
  return names;
}

bool is_meant(std::string_view typed, const Profile& profile) {
  return is_whole(typed, profile) || !candidates_for(typed, profile).all().empty();
}

Result<std::string> one_meant_by(std::string_view typed, const Profile& profile) {
  if (is_whole(typed, profile)) return std::string(typed);
  const Candidates candidates = candidates_for(typed, profile);
  const auto names = candidates.all();
  if (names.empty()) return std::string(typed);
  if (names.size() == 1) return names.front();
  const bool is_beginning = candidates.ending.empty();
  return tl::unexpected(
      ambiguous(typed, candidates, is_beginning ? std::string(typed) : fmt::format("*.{}", typed)));
}

}  // namespace spindle::catalogue
