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
  Table<unsigned, Text> models;    ///< tool model code to name; only known codes match
  unsigned firmware_below = 0;     ///< the profile's register map ends here; 0: no such limit
};

/// What one tool says of itself.
struct Identity {
  Bytes raw = {};
  std::optional<unsigned> id = std::nullopt;
  std::optional<unsigned> controller_model_code = std::nullopt;
  std::optional<unsigned> tool_model_code = std::nullopt;
  std::optional<unsigned> firmware = std::nullopt;
  std::string tool_model = {};  ///< name by the profile's table; empty when unknown
  std::string serial = {};
  std::optional<std::uint32_t> total = std::nullopt;
  /// Profile that the product code names; empty where the answer does not tell products apart.
  std::string product_profile = {};
  std::vector<std::string> notes = {};
};

/// Whether the identity fits this profile's map.
enum class Generation : std::uint8_t {
  known,    ///< layout, model code and firmware are those of this profile
  later,    ///< this maker's layout, but a firmware at or above the limit: other registers
  unknown,  ///< not this layout, or no such model
};

/// Reads what is there; never fails (a short or foreign answer leaves fields empty and says so in
/// notes).
Identity decode_identity(const IdentitySpec& facts, ByteView answer);

Generation generation_of(const IdentitySpec& facts, const Identity& identity);

}  // namespace spindle::catalogue
