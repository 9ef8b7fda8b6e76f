#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/base/error.hpp"
#include "spindle/catalogue/list.hpp"
#include "spindle/catalogue/text.hpp"

namespace spindle::catalogue {

/// Bytes of the identity answer, counted from 0 behind the byte count; big-endian.
struct Slice {
  std::uint8_t offset = 0;
  std::uint8_t size = 0;
};

/// What a user should know before writing to a tool whose firmware is one of these, both inclusive.
struct FirmwareCaution {
  unsigned from = 0;
  unsigned to = 0;
  Text text;  ///< half a sentence
};

/// How a product's answer to FC 11h is read. A profile without it cannot be recognised.
struct IdentitySpec {
  std::uint8_t minimum_bytes = 0;  ///< a shorter answer is another product's
  Slice id = {};
  Slice controller_model = {};
  Slice tool_model = {};
  Slice firmware = {};
  Slice serial = {};
  /// From `long_serial_bytes` bytes on the serial is this slice instead, printed as the decimal
  /// pairs of its bytes, last byte first.
  std::uint8_t long_serial_bytes = 0;  ///< 0: there is none
  Slice long_serial = {};
  std::uint8_t product_byte = 0;   ///< offset of the product code in the whole answer
  Table<unsigned, Text> products;  ///< product code to profile id
  std::uint8_t total_bytes = 0;    ///< from this many bytes on `total` is there; 0: never
  Slice total = {};                ///< count of fastenings in the tool's life
  /// Tool model code to name; only known codes match. Empty: the code says nothing, and a tool is
  /// known by its firmware and its product code.
  Table<unsigned, Text> models;
  unsigned firmware_from = 0;   ///< the profile's register map begins here; 0: no such limit
  unsigned firmware_below = 0;  ///< the profile's register map ends here; 0: no such limit
  List<FirmwareCaution> cautions = {};
  /// Parameters in which the tool says more of itself; each may be empty.
  Text model_from = {};          ///< a text: the name of its model
  Text serial_from = {};         ///< a text: its serial number, as FC 11h says it, too
  List<Text> version_from = {};  ///< numbers: the version of its firmware, the gravest first

  /// Whether the answer to FC 11h is not all that the tool says of itself.
  [[nodiscard]] bool has_more() const {
    return !model_from.empty() || !serial_from.empty() || !version_from.empty();
  }
};

/// What one tool says of itself.
struct Identity {
  Bytes raw = {};
  std::optional<unsigned> id = std::nullopt;
  std::optional<unsigned> controller_model_code = std::nullopt;
  std::optional<unsigned> tool_model_code = std::nullopt;
  std::optional<unsigned> firmware = std::nullopt;
  std::string tool_model = {};  ///< name by the profile's table, or by the tool; empty: unknown
  std::string serial = {};
  std::string version = {};  ///< "4.0.2", as the tool says it in registers; empty: it does not
  std::optional<std::uint32_t> total = std::nullopt;
  /// Profile that the product code names; empty where the answer does not tell products apart.
  std::string product_profile = {};
  std::vector<std::string> notes = {};
};

/// Whether the identity fits this profile's map.
enum class Generation : std::uint8_t {
  known,    ///< layout, model code and firmware are those of this profile
  earlier,  ///< this maker's layout, but a firmware below the first of the profile
  later,    ///< this maker's layout, but a firmware at or above the limit: other registers
  unknown,  ///< not this layout, or no such model
};

/// Reads what is there; never fails (a short or foreign answer leaves fields empty and says so in
/// notes).
Identity decode_identity(const IdentitySpec& facts, ByteView answer);

Generation generation_of(const IdentitySpec& facts, const Identity& identity);

/// What the profile says of writing to a tool with this firmware; empty: nothing.
std::string caution_of(const IdentitySpec& facts, const Identity& identity);

}  // namespace spindle::catalogue
