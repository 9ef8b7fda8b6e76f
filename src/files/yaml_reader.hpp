#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/error.hpp"
#include "spindle/files/finding.hpp"

namespace spindle::files {

/// Faults of several files, collected instead of stopping at the first. Keeps the first thousand.
class Diagnostics {
 public:
  /// The number by which positions name this file.
  std::size_t add_file(std::string path);

  /// The same fault at the same location counts once.
  void add(const SourceLocation& at, std::string message);
  /// Only when nothing is wrong at this location yet: a repeated entry tells its fault once.
  void add_once(const SourceLocation& at, std::string message);

  [[nodiscard]] bool empty() const { return entries_.empty(); }
  /// How often something was told so far: grows with every fault, also with one told before.
  [[nodiscard]] std::size_t told() const { return told_; }
  /// Sorted by location.
  [[nodiscard]] std::vector<Diagnostic> list() const;
  /// The first finding as `bad_file`, and how many there are. Requires at least one.
  [[nodiscard]] Error error() const;

 private:
  struct Entry {
    SourceLocation at;
    std::string message;
  };
  std::vector<std::string> files_;
  std::vector<Entry> entries_;  ///< sorted by location
  std::size_t told_ = 0;
};

struct YamlEntry;

/// A YAML value as it was written. Scalars stay text: nothing is guessed from their looks.
struct YamlNode {
  enum class Kind : std::uint8_t { nothing, scalar, sequence, map };
  Kind kind = Kind::nothing;
  SourceLocation at = {};
  std::string text = {};           ///< of a scalar
  std::vector<YamlNode> items;     ///< of a sequence
  std::vector<YamlEntry> entries;  ///< of a map, in the order of the file

  /// The value of a key of this map; null when it is not there or this is no map.
  [[nodiscard]] const YamlNode* find(std::string_view key) const;
};

struct YamlEntry {
  std::string key;
  SourceLocation key_at;
  YamlNode value;
};

/// Which documents of a file are wanted; the rest is not even scanned.
enum class Documents : std::uint8_t { first, all };

/// The documents of a YAML text. Strict: aliases, anchors, tags, duplicate keys, keys that are no
/// plain text, NUL and invalid UTF-8 are findings. After a syntax error the documents before it are
/// returned; empty ones at the end are dropped. Time and memory are bounded whatever the text is:
/// one that is too large, nested too deep or has too many values is a finding and is not read on.
std::vector<YamlNode> parse_yaml(std::string_view text, std::size_t file, Documents documents,
                                 Diagnostics& findings);

}  // namespace spindle::files
