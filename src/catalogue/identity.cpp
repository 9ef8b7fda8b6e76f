#include "spindle/catalogue/identity.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace spindle::catalogue {
namespace {

/// Binary identities have zero high bytes that break up any run of printable bytes; generic
/// servers answer FC 11h with a name instead.
constexpr std::size_t text_run = 7;

constexpr unsigned bits_per_byte = 8;
constexpr std::uint8_t largest_pair = 99;

bool printable(std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; }

bool looks_like_text(ByteView bytes) {
  return std::search_n(bytes.begin(), bytes.end(), text_run, true,
                       [](std::uint8_t byte, bool) { return printable(byte); }) != bytes.end();
}

bool fits(const IdentitySpec& facts, ByteView answer) {
  return answer.size() >= facts.minimum_bytes &&
         !looks_like_text(answer.first(facts.minimum_bytes));
}

std::optional<ByteView> cut(ByteView answer, const Slice& slice) {
  const std::size_t end = std::size_t{slice.offset} + slice.size;
  if (slice.size == 0 || end > answer.size()) return std::nullopt;
  return answer.subspan(slice.offset, slice.size);
}

std::optional<unsigned> number_at(ByteView answer, const Slice& slice) {
  const auto bytes = cut(answer, slice);
  if (!bytes) return std::nullopt;
  unsigned number = 0;
  for (const std::uint8_t byte : *bytes) number = (number << bits_per_byte) | byte;
  return number;
}

void read_long_serial(ByteView bytes, Identity& identity) {
  if (std::any_of(bytes.begin(), bytes.end(),
                  [](std::uint8_t byte) { return byte > largest_pair; })) {
    identity.serial = to_compact_hex(bytes);
    identity.notes.emplace_back("serial number is not made of decimal pairs, shown as hexadecimal");
    return;
  }
  for (std::size_t i = bytes.size(); i > 0; --i) {
    fmt::format_to(std::back_inserter(identity.serial), "{:02}", bytes[i - 1]);
  }
}

void read_product(const IdentitySpec& facts, ByteView answer, Identity& identity) {
  const unsigned code = answer[facts.product_byte];
  if (const Text* id = facts.products.find(code)) {
    identity.product_profile = *id;
  } else {
    identity.notes.push_back(fmt::format("product code {} is not known", code));
  }
}

void read_serial(const IdentitySpec& facts, ByteView answer, Identity& identity) {
  const bool is_long = facts.long_serial_bytes != 0 && answer.size() >= facts.long_serial_bytes;
  if (!is_long) {
    if (const auto number = number_at(answer, facts.serial)) {
      identity.serial = std::to_string(*number);
    }
    return;
  }
  if (const auto bytes = cut(answer, facts.long_serial)) read_long_serial(*bytes, identity);
  if (!facts.products.empty() && facts.product_byte < answer.size()) {
    read_product(facts, answer, identity);
  }
}

void read_model(const IdentitySpec& facts, ByteView answer, Identity& identity) {
  identity.tool_model_code = number_at(answer, facts.tool_model);
  if (!identity.tool_model_code || facts.models.empty()) return;
  if (const Text* name = facts.models.find(*identity.tool_model_code)) {
    identity.tool_model = *name;
  } else {
    identity.notes.push_back(
        fmt::format("tool model code {} is not known", *identity.tool_model_code));
  }
}

/// By its model code where the profile has a table of them, else by its product code.
bool is_product_known(const IdentitySpec& facts, const Identity& identity) {
  if (facts.models.empty()) return !identity.product_profile.empty();
  return identity.tool_model_code && facts.models.contains(*identity.tool_model_code);
}

}  // namespace

Identity decode_identity(const IdentitySpec& facts, ByteView answer) {
  Identity identity;
  identity.raw.assign(answer.begin(), answer.end());
  if (answer.size() < facts.minimum_bytes) {
    identity.notes.push_back(fmt::format("identity has {} bytes, at least {} were expected",
                                         answer.size(), facts.minimum_bytes));
    return identity;
  }
  if (!fits(facts, answer)) {
    identity.notes.emplace_back("identity is a text, as generic Modbus servers send it");
    return identity;
  }
  identity.id = number_at(answer, facts.id);
  identity.controller_model_code = number_at(answer, facts.controller_model);
  identity.firmware = number_at(answer, facts.firmware);
  read_model(facts, answer, identity);
  read_serial(facts, answer, identity);
  if (facts.total_bytes != 0 && answer.size() >= facts.total_bytes) {
    identity.total = number_at(answer, facts.total);
  }
  return identity;
}

Generation generation_of(const IdentitySpec& facts, const Identity& identity) {
  if (!fits(facts, identity.raw)) return Generation::unknown;
  const unsigned firmware = identity.firmware.value_or(0);
  if (firmware == 0) return Generation::unknown;
  if (facts.firmware_below != 0 && firmware >= facts.firmware_below) return Generation::later;
  if (!is_product_known(facts, identity)) return Generation::unknown;
  return firmware < facts.firmware_from ? Generation::earlier : Generation::known;
}

std::string caution_of(const IdentitySpec& facts, const Identity& identity) {
  for (const FirmwareCaution& caution : facts.cautions) {
    if (identity.firmware && *identity.firmware >= caution.from &&
        *identity.firmware <= caution.to) {
      return caution.text.to_string();
    }
  }
  return {};
}

}  // namespace spindle::catalogue
