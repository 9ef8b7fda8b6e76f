#include "files/identity_lines.hpp"

#include <fmt/format.h>

#include "files/yaml_text.hpp"
#include "spindle/base/text.hpp"

namespace spindle::files {
namespace {

/// Bytes in hexadecimal digits, separated by one blank or more.
Bytes read_hex(const YamlNode& node, Diagnostics& findings) {
  std::vector<std::string_view> words = split(node.text, ' ');
  std::erase(words, "");
  return to_bytes(node, words, findings);
}

}  // namespace

void read_identity_bytes(const YamlNode& node, catalogue::SnapshotIdentity& identity,
                         const Asked& asked) {
  identity.raw = read_hex(node, asked.findings);
}

std::string line_of(const catalogue::SnapshotIdentity& identity) {
  std::string line = "identity: {";
  if (!identity.model.empty()) line += fmt::format("model: {}, ", quoted(identity.model));
  if (identity.model_code) line += fmt::format("model-code: {}, ", *identity.model_code);
  if (!identity.serial.empty()) line += fmt::format("serial: {}, ", quoted(identity.serial));
  if (!identity.version.empty()) line += fmt::format("version: {}, ", quoted(identity.version));
  if (identity.firmware) line += fmt::format("firmware: {}, ", *identity.firmware);
  return line + fmt::format("raw: {}}}\n", quoted(to_hex(identity.raw)));
}

}  // namespace spindle::files
