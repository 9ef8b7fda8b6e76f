#include "files/yaml_reader.hpp"

#include <fmt/format.h>
#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>
#include <unordered_set>
#include <utility>

#include "spindle/base/utf8.hpp"

namespace spindle::files {
namespace {

/// Far above any profile (tens of kilobytes) or tools file; keeps a wrong path from filling memory.
constexpr std::size_t largest_file = std::size_t{1} << 20;

constexpr std::size_t read_step = 16384;

/// No format of ours nests deeper than six; bounds recursion over the tree.
constexpr std::size_t deepest_nesting = 32;

/// An explicit end: without it the parser takes a quoted text that is never closed for complete.
/// Behind an empty text it makes an empty document.
constexpr std::string_view end_of_text = "\n...\n";

Position to_position(const YAML::Mark& mark, std::size_t file) {
  return {file, std::max(mark.line, 0) + 1, std::max(mark.column, 0) + 1};
}

/// Tags that the parser makes up itself: "?" for plain and "!" for quoted scalars, "" or "?" for
/// collections.
bool is_explicit(const std::string& tag) { return !tag.empty() && tag != "?" && tag != "!"; }

/// Builds the tree from events; a collection is kept open on a stack until its end.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(std::size_t file, Findings& findings) : file_(file), findings_(findings) {}

  [[nodiscard]] YamlNode take() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    root_ = YamlNode{.at = to_position(mark, file_), .items = {}, .entries = {}};
    open_.clear();
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    check_anchor(mark, anchor);
    add(make(YamlNode::Kind::nothing, mark));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    findings_.add(to_position(mark, file_), "aliases are not supported; write the value out");
    add(make(YamlNode::Kind::scalar, mark));
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    check_anchor(mark, anchor);
    check_tag(mark, tag);
    YamlNode node = make(YamlNode::Kind::scalar, mark);
    node.text = value;
    add(std::move(node));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    start(YamlNode::Kind::sequence, mark, tag, anchor);
  }
  void OnSequenceEnd() override { finish(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    start(YamlNode::Kind::map, mark, tag, anchor);
  }
  void OnMapEnd() override {
    check_duplicates(open_.back().node);
    finish();
  }

 private:
  struct Open {
    YamlNode node;
    std::optional<YamlNode> key;  ///< of a map whose value has not come yet
  };

  [[nodiscard]] YamlNode make(YamlNode::Kind kind, const YAML::Mark& mark) const {
    return YamlNode{.kind = kind, .at = to_position(mark, file_), .items = {}, .entries = {}};
  }

  void check_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor == YAML::NullAnchor) return;
    findings_.add(to_position(mark, file_), "anchors are not supported; write the value out");
  }

  void check_tag(const YAML::Mark& mark, const std::string& tag) {
    if (!is_explicit(tag)) return;
    findings_.add(to_position(mark, file_), "tags are not supported");
  }

  void start(YamlNode::Kind kind, const YAML::Mark& mark, const std::string& tag,
             YAML::anchor_t anchor) {
    check_anchor(mark, anchor);
    check_tag(mark, tag);
    if (open_.size() == deepest_nesting) {
      findings_.add(to_position(mark, file_),
                    fmt::format("nested more than {} levels deep", deepest_nesting));
    }
    open_.push_back({make(kind, mark), std::nullopt});
  }

  void finish() {
    YamlNode node = std::move(open_.back().node);
    open_.pop_back();
    // Dropping what is too deep bounds the tree; it was already reported.
    if (open_.size() > deepest_nesting) node = YamlNode{.at = node.at, .items = {}, .entries = {}};
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

  std::size_t file_;
  Findings& findings_;
  YamlNode root_ = {};
  std::vector<Open> open_;
};

/// What the parser complains about, in our words. Its own are matched by their beginning, because
/// some go on with details.
std::string_view cause_of(std::string_view complaint) {
  struct Cause {
    std::string_view complaint;
    std::string_view text;
  };
  static constexpr std::array causes = {
      Cause{"end of map flow not found", "a '}' is missing"},
      Cause{"end of map not found", "a line is indented differently from its neighbours"},
      Cause{"end of sequence flow not found", "a ']' is missing"},
      Cause{"end of sequence not found", "a line is indented differently from its neighbours"},
      Cause{"illegal map value", "a ':' where no key is; quote texts that contain ': '"},
      Cause{"illegal block entry", "a '-' where no list is"},
      Cause{"illegal flow end", "a '}' or ']' that closes nothing"},
      Cause{"illegal EOF in scalar", "a quoted text is never closed"},
      Cause{"illegal tab when looking for indentation", "a tab in the indentation; use spaces"},
      Cause{"illegal document indicator in scalar", "a quoted text is never closed"},
      Cause{"unknown escape character", "an unknown escape behind '\\' in a quoted text"},
      Cause{"bad character found while scanning", "a character that YAML does not allow"},
      Cause{"unknown token", "a character that cannot begin a value; quote the text"},
  };
  for (const Cause& cause : causes) {
    if (complaint.starts_with(cause.complaint)) return cause.text;
  }
  return "the structure is broken";
}

void parse_documents(std::string_view text, std::size_t file, Documents wanted, Findings& findings,
                     std::vector<YamlNode>& documents) {
  std::istringstream stream(std::string(text).append(end_of_text));
  YAML::Parser parser(stream);
  TreeBuilder builder(file, findings);
  while (parser.HandleNextDocument(builder)) {
    documents.push_back(builder.take());
    if (wanted == Documents::first) break;
  }
  while (!documents.empty() && documents.back().kind == YamlNode::Kind::nothing) {
    documents.pop_back();
  }
}

/// Checked before the parser sees the text, because it replaces what it does not understand.
bool check_characters(std::string_view text, std::size_t file, Findings& findings) {
  Position at{file, 1, 1};
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
    at = text[i] == '\n' ? Position{file, at.line + 1, 1}
                         : Position{file, at.line, at.column + static_cast<int>(character.length)};
    i += character.length;
  }
  return true;
}

Error unreadable(const std::string& path, std::string message) {
  return {.code = Errc::bad_file, .message = std::move(message), .name = path};
}

/// Why the system would not open it, in its own words but for what everybody knows.
Error not_opened(const std::string& path, int code) {
  if (code == ENOENT || code == ENOTDIR) return unreadable(path, "no such file");
  Error error = unreadable(path, fmt::format("the file cannot be opened for reading: {}",
                                             std::generic_category().message(code)));
  if (code == EACCES) error.hint = "check who may read it, and who may look into its folder";
  return error;
}

}  // namespace

std::string Finding::to_string() const {
  return fmt::format("{}:{}:{}: {}", file, line, column, message);
}

std::size_t Findings::add_file(std::string path) {
  files_.push_back(std::move(path));
  return files_.size() - 1;
}

void Findings::add(const Position& at, std::string message) {
  auto place = std::lower_bound(
      entries_.begin(), entries_.end(), at,
      [](const Entry& entry, const Position& position) { return entry.at < position; });
  for (; place != entries_.end() && place->at == at; ++place) {
    if (place->message == message) return;
  }
  entries_.insert(place, {at, std::move(message)});
}

void Findings::add_once(const Position& at, std::string message) {
  const bool told = std::any_of(entries_.begin(), entries_.end(),
                                [&](const Entry& entry) { return entry.at == at; });
  if (!told) add(at, std::move(message));
}

std::vector<Finding> Findings::list() const {
  std::vector<Finding> findings;
  findings.reserve(entries_.size());
  for (const Entry& entry : entries_) {
    findings.push_back({files_.at(entry.at.file), entry.at.line, entry.at.column, entry.message});
  }
  return findings;
}

Error Findings::error() const {
  const Entry& first = entries_.front();
  const std::string& path = files_.at(first.at.file);
  std::string message = Finding{path, first.at.line, first.at.column, first.message}.to_string();
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

Result<std::string> read_text_file(const std::string& path) {
  std::error_code problem;
  if (std::filesystem::is_directory(path, problem)) {
    return tl::unexpected(unreadable(path, "is a folder, not a file"));
  }
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return tl::unexpected(not_opened(path, errno));
  std::string text;
  std::array<char, read_step> step{};
  while (stream && text.size() <= largest_file) {
    stream.read(step.data(), step.size());
    text.append(step.data(), static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) return tl::unexpected(unreadable(path, "the file cannot be read"));
  if (text.size() > largest_file) {
    return tl::unexpected(unreadable(
        path, fmt::format("larger than {} bytes; this is no file of spindle's", largest_file)));
  }
  return text;
}

std::vector<YamlNode> parse_yaml(std::string_view text, std::size_t file, Documents documents,
                                 Findings& findings) {
  std::vector<YamlNode> parsed;
  if (!check_characters(text, file, findings)) return parsed;
  try {
    parse_documents(text, file, documents, findings, parsed);
  } catch (const YAML::DeepRecursion& problem) {
    findings.add(to_position(problem.mark, file), "nested too deep");
  } catch (const YAML::Exception& problem) {
    findings.add(to_position(problem.mark, file),
                 fmt::format("not valid YAML here: {}", cause_of(problem.msg)));
  } catch (const std::exception&) {
    findings.add({file, 1, 1}, "not valid YAML: the parser gave up");
  }
  return parsed;
}

}  // namespace spindle::files
