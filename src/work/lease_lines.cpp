#include "spindle/work/lease_lines.hpp"

#include <fmt/format.h>

#include <limits>

#include "spindle/base/percent.hpp"
#include "spindle/base/text.hpp"

namespace spindle::work {
namespace {

constexpr std::string_view no_block = "-";
constexpr std::uint64_t largest = std::numeric_limits<std::int64_t>::max();

std::string written(std::string_view word) {
  if (word.empty()) return "%";
  std::string text;
  for (const char c : word) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_plain = byte > 0x20 && byte != 0x7F && c != '%';
    text += is_plain ? std::string(1, c) : percent_encoded(c);
  }
  return text;
}

std::optional<std::string> read(std::string_view text) {
  return text == "%" ? std::string() : percent_decoded(text);
}

std::string hex_of(const Registers& block) {
  Bytes bytes;
  for (const std::uint16_t word : block) put_u16(bytes, word);
  return to_compact_hex(bytes);
}

std::optional<Registers> block_of(std::string_view hex) {
  constexpr std::size_t digits = 4;
  Registers block;
  if (hex.size() % digits != 0) return std::nullopt;
  for (std::size_t at = 0; at < hex.size(); at += digits) {
    const auto word = parse_unsigned(fmt::format("0x{}", hex.substr(at, digits)), 0xFFFF);
    if (!word) return std::nullopt;
    block.push_back(static_cast<std::uint16_t>(*word));
  }
  return block;
}

}  // namespace

std::string to_line(const LeaseLine& line) {
  std::string text = fmt::format("{} {}", line.verb, line.id);
  for (const std::string& word : line.words) text += " " + written(word);
  return text;
}

std::optional<LeaseLine> lease_line_of(std::string_view line) {
  const std::vector<std::string_view> parts = split(line, ' ');
  if (parts.size() < 2 || parts.front().empty()) return std::nullopt;
  const auto id = parse_unsigned(parts[1], largest);
  if (!id) return std::nullopt;
  LeaseLine read_line{.verb = std::string(parts.front()), .id = *id};
  for (std::size_t at = 2; at < parts.size(); ++at) {
    auto word = read(parts[at]);
    if (!word) return std::nullopt;
    read_line.words.push_back(std::move(*word));
  }
  return read_line;
}

std::vector<std::string> words_of(const store::Last& last) {
  return {fmt::format("{}", last.epoch), fmt::format("{}", last.number),
          fmt::format("{}", last.seen.time_since_epoch().count()),
          last.block ? hex_of(*last.block) : std::string(no_block)};
}

std::optional<store::Last> last_of(const std::vector<std::string>& words) {
  if (words.size() != 4) return std::nullopt;
  const auto epoch = parse_unsigned(words[0], largest);
  const auto number = parse_unsigned(words[1], std::numeric_limits<std::uint16_t>::max());
  const auto seen = parse_unsigned(words[2], largest);
  if (!epoch || !number || !seen) return std::nullopt;
  store::Last last{.epoch = static_cast<std::int64_t>(*epoch),
                   .number = static_cast<std::uint16_t>(*number),
                   .seen = WallTime(std::chrono::milliseconds(*seen))};
  if (words[3] == no_block) return last;
  last.block = block_of(words[3]);
  if (!last.block) return std::nullopt;
  return last;
}

}  // namespace spindle::work
