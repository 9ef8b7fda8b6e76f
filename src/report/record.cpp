#include "spindle/report/record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "spindle/base/duration.hpp"

namespace spindle::report {
namespace {

struct CellText {
  std::string operator()(std::monostate /*null*/) const { return {}; }
  std::string operator()(const Decimal& number) const { return number.to_string(); }
  std::string operator()(const std::string& text) const { return text; }
  std::string operator()(bool truth) const { return truth ? "true" : "false"; }
  std::string operator()(const Words& words) const {
    return fmt::format("{}", fmt::join(words, " "));
  }
  std::string operator()(const Numbers& numbers) const {
    std::string text;
    for (const std::optional<Decimal>& one : numbers) {
      if (!text.empty()) text += ' ';
      text += one ? one->to_string() : "-";
    }
    return text;
  }
  std::string operator()(const Texts& texts) const {
    return fmt::format("{}", fmt::join(texts, ", "));
  }
  std::string operator()(const Pairs& pairs) const {
    std::string text;
    for (const auto& [key, value] : pairs) {
      if (!text.empty()) text += ", ";
      text.append(key).append("=").append(value);
    }
    return text;
  }
};

}  // namespace

Cell text_or_null(std::string text) {
  return text.empty() ? Cell(std::monostate()) : Cell(std::move(text));
}

Cell number(std::int64_t value) { return Decimal(value); }

Cell count(std::size_t things) { return number(static_cast<std::int64_t>(things)); }

const Field* Record::find(std::string_view key) const {
  const auto found =
      std::find_if(fields.begin(), fields.end(), [key](const Field& f) { return f.key == key; });
  return found == fields.end() ? nullptr : &*found;
}

std::string to_text(WallTime time) { return spindle::to_text(time); }

std::string to_text(const Cell& cell) { return std::visit(CellText{}, cell); }

}  // namespace spindle::report
