#include "files/yaml_reader.hpp"

#include <fmt/format.h>
#include <yaml.h>

#include <algorithm>
#include <array>
#include <optional>
#include <unordered_set>
#include <utility>

#include "spindle/base/utf8.hpp"

namespace spindle::files {
namespace {

/// Far above any profile (tens of kilobytes) or tools file; keeps a wrong path from filling memory.
constexpr std::size_t largest_file = std::size_t{1} << 20;

/// No format of ours nests deeper than six; bounds recursion over the tree.
constexpr std::size_t deepest_nesting = 32;

/// A backup of two thousand parameters has twenty thousand; bounds the memory of the tree.
constexpr std::size_t most_values = 100'000;

/// No user mends more in one go; bounds the work on a file that is something else altogether.
constexpr std::size_t most_findings = 1'000;

/// Locations by the number of code points in front, which is how the parser counts; they are asked
/// for in the order of the text.
class LocationFinder {
 public:
  LocationFinder(std::string_view text, std::size_t file) : text_(text), at_{file, 1, 1} {}

  /// The location, or the last one asked for when that is behind it.
  SourceLocation find(std::size_t index) {
    while (index_ < index && byte_ < text_.size()) step();
    return at_;
  }
  SourceLocation find_byte(std::size_t byte) {
    while (byte_ < byte && byte_ < text_.size()) step();
    return at_;
  }
  /// What stands at the location that was found last; NUL at the end of the text.
  [[nodiscard]] char here() const { return byte_ < text_.size() ? text_[byte_] : '\0'; }
  /// Whether only blanks stand in front of it in its line.
  [[nodiscard]] bool begins_line() const {
    const std::string_view line =
        text_.substr(0, byte_).substr(byte_ + 1 - static_cast<std::size_t>(at_.column));
    return line.find_first_not_of(" \t") == std::string_view::npos;
  }

 private:
  void step() {
    const std::size_t length = first_code_point(text_.substr(byte_)).length;
    at_.column += static_cast<int>(length);
    if (text_[byte_] == '\n') {
      ++at_.line;
      at_.column = 1;
    }
    byte_ += length;
    ++index_;
  }

  std::string_view text_;
  std::size_t index_ = 0;
  std::size_t byte_ = 0;
  SourceLocation at_;
};

/// The parser of libyaml over one text. It looks at most 1,024 characters ahead, and keeps of
/// what it has told only how deep it is nested.
class Parser {
 public:
  explicit Parser(std::string_view text) {
    // Its only failure is a lack of memory, which next() tells as well.
    sound_ = yaml_parser_initialize(&parser_) != 0;
    if (!sound_) return;
    yaml_parser_set_encoding(&parser_, YAML_UTF8_ENCODING);
    yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(text.data()),
                                 text.size());
  }
  ~Parser() {
    forget();
    if (sound_) yaml_parser_delete(&parser_);
  }
  Parser(const Parser&) = delete;
  Parser& operator=(const Parser&) = delete;

  /// The next event, valid until the next call; null when the text is no YAML from here on.
  const yaml_event_t* next() {
    forget();
    has_event_ = sound_ && yaml_parser_parse(&parser_, &event_) != 0;
    return has_event_ ? &event_ : nullptr;
  }

  [[nodiscard]] const yaml_parser_t& state() const { return parser_; }
  /// False: the parser could not even begin.
  [[nodiscard]] bool sound() const { return sound_; }

 private:
  void forget() {
    if (has_event_) yaml_event_delete(&event_);
    has_event_ = false;
  }

  yaml_parser_t parser_ = {};
  yaml_event_t event_ = {};
  bool sound_ = false;
  bool has_event_ = false;
};

std::string_view to_view(const yaml_char_t* text, std::size_t length) {
  return {reinterpret_cast<const char*>(text), length};
}

/// Plain words that YAML takes for no value at all.
bool is_null_word(std::string_view text) {
  constexpr std::array<std::string_view, 5> words = {"", "~", "null", "Null", "NULL"};
  return std::find(words.begin(), words.end(), text) != words.end();
}

/// Builds the tree from events; a collection is kept open on a stack until its end.
class TreeBuilder {
 public:
  TreeBuilder(LocationFinder& locations, Diagnostics& findings)
      : locations_(locations), findings_(findings) {}

  [[nodiscard]] YamlNode take() { return std::move(root_); }

  /// False: the text takes more than any file of ours, and is not to be read on.
  [[nodiscard]] bool take(const yaml_event_t& event) {
    const SourceLocation at = locations_.find(event.start_mark.index);
    switch (event.type) {
      case YAML_DOCUMENT_START_EVENT:
        root_ = YamlNode{.at = at, .items = {}, .entries = {}};
        return true;
      case YAML_ALIAS_EVENT:
        findings_.add(at, "aliases are not supported; write the value out");
        add(make(YamlNode::Kind::scalar, at));
        return is_within_bounds(at);
      case YAML_SCALAR_EVENT:
        add_scalar(event, at);
        return is_within_bounds(at);
      case YAML_SEQUENCE_START_EVENT:
        check_properties(at, event.data.sequence_start.anchor, event.data.sequence_start.tag);
        open_.push_back({make(YamlNode::Kind::sequence, at), std::nullopt});
        return is_within_bounds(at);
      case YAML_MAPPING_START_EVENT:
        check_properties(at, event.data.mapping_start.anchor, event.data.mapping_start.tag);
        open_.push_back({make(YamlNode::Kind::map, at), std::nullopt});
        return is_within_bounds(at);
      case YAML_MAPPING_END_EVENT:
        check_duplicates(open_.back().node);
        finish();
        return true;
      case YAML_SEQUENCE_END_EVENT:
        finish();
        return true;
      default:
        return true;
    }
  }

 private:
  struct Open {
    YamlNode node;
    std::optional<YamlNode> key;  ///< of a map whose value has not come yet
  };

  [[nodiscard]] YamlNode make(YamlNode::Kind kind, const SourceLocation& at) {
    ++values_;
    return YamlNode{.kind = kind, .at = at, .items = {}, .entries = {}};
  }

  [[nodiscard]] bool is_within_bounds(const SourceLocation& at) {
    if (open_.size() > deepest_nesting) {
      findings_.add(at, fmt::format("nested more than {} levels deep", deepest_nesting));
      return false;
    }
    if (values_ > most_values) {
      findings_.add(at,
                    fmt::format("more than {} values; this is no file of spindle's", most_values));
      return false;
    }
    return true;
  }

  void check_properties(const SourceLocation& at, const yaml_char_t* anchor,
                        const yaml_char_t* tag) {
    if (anchor != nullptr) findings_.add(at, "anchors are not supported; write the value out");
    if (tag != nullptr) findings_.add(at, "tags are not supported");
  }

  void add_scalar(const yaml_event_t& event, const SourceLocation& at) {
    const auto& scalar = event.data.scalar;
    check_properties(at, scalar.anchor, scalar.tag);
    const std::string_view text = to_view(scalar.value, scalar.length);
    const bool plain = scalar.style == YAML_PLAIN_SCALAR_STYLE;
    // 'null' is a key of profiles.
    const bool nothing = plain && is_null_word(text) && !(text == "null" && is_at_key());
    YamlNode node = make(nothing ? YamlNode::Kind::nothing : YamlNode::Kind::scalar, at);
    if (!nothing) node.text = text;
    add(std::move(node));
  }

  /// Whether what comes next is a key of a map.
  [[nodiscard]] bool is_at_key() const {
    return !open_.empty() && open_.back().node.kind == YamlNode::Kind::map && !open_.back().key;
  }

  void finish() {
    YamlNode node = std::move(open_.back().node);
    open_.pop_back();
    add(std::move(node));
  }

  void add(YamlNode node) {
    if (open_.empty()) {
      root_ = std::move(node);
      return;
    }
    Open& parent = open_.back();
    if (parent.node.kind == YamlNode::Kind::sequence) {
      parent.node.items.push_back(std::move(node));
    } else if (!parent.key) {
      check_key(node);
      parent.key = std::move(node);
    } else {
      parent.node.entries.push_back({std::move(parent.key->text), parent.key->at, std::move(node)});
      parent.key.reset();
    }
  }

  void check_key(const YamlNode& key) {
    if (key.kind == YamlNode::Kind::scalar) return;
    findings_.add(key.at, "a key must be a plain word");
  }

  void check_duplicates(const YamlNode& map) {
    std::unordered_set<std::string_view> seen;
    seen.reserve(map.entries.size());
    for (const YamlEntry& entry : map.entries) {
      if (!seen.insert(entry.key).second) {
        findings_.add(entry.key_at, fmt::format("key '{}' is given twice", entry.key));
      }
    }
  }

  LocationFinder& locations_;
  Diagnostics& findings_;
  YamlNode root_ = {};
  std::vector<Open> open_;
  std::size_t values_ = 0;
};

/// What stands where the parser gave up, when that says more than its own words.
std::string_view cause_of(char here) {
  switch (here) {
    case ',':
      return "a ',' outside of '[ ]' and '{ }'; quote the text";
    case ']':
    case '}':
      return "a '}' or ']' that closes nothing";
    case '\t':
      return "a tab in the indentation; use spaces";
    case '@':
    case '`':
    case '%':
      return "a character that cannot begin a value; quote the text";
    default:
      return "";
  }
}

/// What the parser complains about, in our words.
std::string_view cause_of(std::string_view complaint, const LocationFinder& locations) {
  struct Cause {
    std::string_view complaint;
    std::string_view text;
  };
  static constexpr std::array ours = {
      Cause{"did not find expected ',' or '}'", "a '}' is missing, or a ','"},
      Cause{"did not find expected ',' or ']'", "a ']' is missing, or a ','"},
      Cause{"found unexpected end of stream", "a quoted text is never closed"},
      Cause{"found unexpected document indicator", "a quoted text is never closed"},
      Cause{"found unknown escape character", "an unknown escape behind '\\' in a quoted text"},
      Cause{"found invalid Unicode character escape code", "an escape that is no character"},
      Cause{"did not find expected hexdecimal number", "an escape without its digits"},
      Cause{"mapping values are not allowed",
            "a ':' where no key is; quote texts that contain ': '"},
      Cause{"mapping keys are not allowed", "a '?' where no key is"},
      Cause{"block sequence entries are not allowed", "a '-' where no list is"},
      Cause{"could not find expected ':'",
            "a line that is neither 'key: value' nor part of a text"},
      Cause{"found a tab character", "a tab in the indentation; use spaces"},
      Cause{"control characters are not allowed", "a character that YAML does not allow"},
      Cause{"found incompatible YAML document", "another version of YAML than 1.1 and 1.2"},
  };
  static constexpr std::array unless_seen = {
      Cause{"did not find expected node content", "a value is missing"},
      Cause{"found character that cannot start",
            "a character that cannot begin a value; quote the text"},
  };
  const auto text_of = [&](const auto& causes) -> std::string_view {
    for (const Cause& cause : causes) {
      if (complaint.starts_with(cause.complaint)) return cause.text;
    }
    return "";
  };
  if (const std::string_view text = text_of(ours); !text.empty()) return text;
  if (const std::string_view text = cause_of(locations.here()); !text.empty()) return text;
  if (const std::string_view text = text_of(unless_seen); !text.empty()) return text;
  if (!complaint.starts_with("did not find expected")) return "the structure is broken";
  return locations.begins_line() ? "a line is indented differently from its neighbours"
                                 : "something behind a finished value; quote the whole text";
}

void add_complaint(const Parser& parser, std::size_t file, LocationFinder& locations,
                   Diagnostics& findings) {
  const yaml_parser_t& state = parser.state();
  if (!parser.sound() || state.error == YAML_MEMORY_ERROR || state.problem == nullptr) {
    findings.add({file, 1, 1}, "not valid YAML: the parser gave up");
    return;
  }
  const SourceLocation at = state.error == YAML_READER_ERROR
                                ? locations.find_byte(state.problem_offset)
                                : locations.find(state.problem_mark.index);
  findings.add(at, fmt::format("not valid YAML here: {}", cause_of(state.problem, locations)));
}

void parse_documents(std::string_view text, std::size_t file, Documents wanted,
                     Diagnostics& findings, std::vector<YamlNode>& documents) {
  Parser parser(text);
  LocationFinder locations(text, file);
  TreeBuilder builder(locations, findings);
  const yaml_event_t* event = parser.next();
  while (event != nullptr && event->type != YAML_STREAM_END_EVENT) {
    const bool begins = event->type == YAML_DOCUMENT_START_EVENT;
    // Only now it is clear that the first one ended where it should.
    if (begins && wanted == Documents::first && !documents.empty()) break;
    if (!builder.take(*event)) break;
    if (event->type == YAML_DOCUMENT_END_EVENT) documents.push_back(builder.take());
    event = parser.next();
  }
  if (event == nullptr) add_complaint(parser, file, locations, findings);
  while (!documents.empty() && documents.back().kind == YamlNode::Kind::nothing) {
    documents.pop_back();
  }
}

/// A text in which each line may declare a tag makes the parser compare each with all others.
bool declares_tags(std::string_view text) {
  constexpr std::string_view directive = "%TAG";
  constexpr std::string_view line_begins = "\n\r\x85\xA8\xA9\xBF";  // last bytes of all breaks
  for (std::size_t at = text.find(directive); at != std::string_view::npos;
       at = text.find(directive, at + 1)) {
    if (at == 0 || line_begins.find(text[at - 1]) != std::string_view::npos) return true;
  }
  return false;
}

/// Checked before the parser sees the text, so that what is wrong is told in our words.
bool check_characters(std::string_view text, std::size_t file, Diagnostics& findings) {
  SourceLocation at{file, 1, 1};
  for (std::size_t i = 0; i < text.size();) {
    const CodePoint character = first_code_point(text.substr(i));
    if (!character.well_formed) {
      findings.add(at, "not valid UTF-8");
      return false;
    }
    if (text[i] == '\0') {
      findings.add(at, "a NUL byte; this is not a text file");
      return false;
    }
    at = text[i] == '\n'
             ? SourceLocation{file, at.line + 1, 1}
             : SourceLocation{file, at.line, at.column + static_cast<int>(character.length)};
    i += character.length;
  }
  if (declares_tags(text)) {
    findings.add({file, 1, 1}, "tags are not supported");
    return false;
  }
  return true;
}

}  // namespace

std::string Diagnostic::to_string() const {
  return fmt::format("{}:{}:{}: {}", file, line, column, message);
}

std::size_t Diagnostics::add_file(std::string path) {
  files_.push_back(std::move(path));
  return files_.size() - 1;
}

void Diagnostics::add(const SourceLocation& at, std::string message) {
  ++told_;
  if (entries_.size() == most_findings) return;
  auto location = std::lower_bound(
      entries_.begin(), entries_.end(), at,
      [](const Entry& entry, const SourceLocation& position) { return entry.at < position; });
  for (; location != entries_.end() && location->at == at; ++location) {
    if (location->message == message) return;
  }
  entries_.insert(location, {at, std::move(message)});
}

void Diagnostics::add_once(const SourceLocation& at, std::string message) {
  const auto location = std::lower_bound(
      entries_.begin(), entries_.end(), at,
      [](const Entry& entry, const SourceLocation& position) { return entry.at < position; });
  ++told_;
  if (location == entries_.end() || location->at != at) add(at, std::move(message));
}

std::vector<Diagnostic> Diagnostics::list() const {
  std::vector<Diagnostic> findings;
  findings.reserve(entries_.size());
  for (const Entry& entry : entries_) {
    findings.push_back({files_.at(entry.at.file), entry.at.line, entry.at.column, entry.message});
  }
  return findings;
}

Error Diagnostics::error() const {
  const Entry& first = entries_.front();
  const std::string& path = files_.at(first.at.file);
  std::string message = Diagnostic{path, first.at.line, first.at.column, first.message}.to_string();
  if (entries_.size() > 1) {
    message +=
        fmt::format(" (and {} more fault{})", entries_.size() - 1, entries_.size() == 2 ? "" : "s");
  }
  return {.code = Errc::bad_file, .message = std::move(message)};
}

const YamlNode* YamlNode::find(std::string_view key) const {
  for (const YamlEntry& entry : entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

std::vector<YamlNode> parse_yaml(std::string_view text, std::size_t file, Documents documents,
                                 Diagnostics& findings) {
  std::vector<YamlNode> parsed;
  if (text.size() > largest_file) {
    findings.add({file, 1, 1}, fmt::format("larger than {} bytes", largest_file));
    return parsed;
  }
  if (check_characters(text, file, findings)) {
    parse_documents(text, file, documents, findings, parsed);
  }
  return parsed;
}

}  // namespace spindle::files
