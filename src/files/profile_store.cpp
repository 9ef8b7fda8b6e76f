#include "spindle/files/profile_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "files/profile_file.hpp"
#include "files/profile_rules.hpp"
#include "spindle/base/text.hpp"

namespace spindle::files {
namespace {

using catalogue::Profile;

constexpr std::string_view extension = ".yaml";

/// Ours have two layers; a user's own makes three.
constexpr std::size_t deepest_chain = 8;

std::string in_folder(const std::string& folder, std::string_view id) {
  return fmt::format("{}/{}{}", folder, id, extension);
}

/// Where one may not look there may be one: reading it says why not.
bool may_be_file(const std::string& path) {
  std::error_code problem;
  return std::filesystem::exists(path, problem) || problem == std::errc::permission_denied;
}

/// One file of a chain of bases.
struct Layer {
  std::string path;
  std::size_t file = 0;  ///< number for findings
  std::vector<YamlNode> documents;
  ProfileHead head;
  bool sound = true;  ///< nothing was wrong when it was read
};

/// Every file that was read, by path: a base that several profiles extend is parsed once.
using Library = std::map<std::string, Layer>;

/// A profile file and those it extends, the file itself first. Points into a library.
using Chain = std::vector<const Layer*>;

/// The base of a layer: beside it, else in the store's folders.
std::optional<std::string> locate_base(const Layer& layer,
                                       const std::vector<std::string>& folders) {
  const std::string& id = layer.head.extends;
  std::string folder = std::filesystem::path(layer.path).parent_path().string();
  if (folder.empty()) folder = ".";
  std::string beside = in_folder(folder, id);
  if (may_be_file(beside)) return beside;
  for (const std::string& other : folders) {
    std::string path = in_folder(other, id);
    if (may_be_file(path)) return path;
  }
  return std::nullopt;
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code problem;
  return std::filesystem::equivalent(a, b, problem);
}

Result<const Layer*> read_layer(const std::string& path, Documents documents, const ReadText& read,
                                Library& library, Findings& findings) {
  if (const auto known = library.find(path); known != library.end()) {
    const bool sound = known->second.sound;
    if (!sound) findings.add({findings.add_file(path), 1, 1}, "the file has faults of its own");
    return &known->second;
  }
  auto text = read(path);
  if (!text) return tl::unexpected(std::move(text.error()));
  Layer layer{.path = path, .file = findings.add_file(path), .documents = {}, .head = {}};
  layer.documents = parse_yaml(*text, layer.file, documents, findings);
  if (!layer.documents.empty()) {
    layer.head = read_head(layer.documents.front(), findings);
  } else if (findings.empty()) {
    findings.add({layer.file, 1, 1}, "the file is empty");
  }
  layer.sound = findings.empty();
  return &library.emplace(path, std::move(layer)).first->second;
}

/// The next file of the chain; empty at its end, or after a finding.
std::optional<std::string> next_of(const Chain& chain, const std::vector<std::string>& folders,
                                   Findings& findings) {
  const ProfileHead& head = chain.back()->head;
  if (head.extends.empty()) return std::nullopt;
  if (!is_catalogue_name(head.extends)) {
    findings.add(head.extends_at, fmt::format("'{}' is no profile id", head.extends));
    return std::nullopt;
  }
  auto path = locate_base(*chain.back(), folders);
  if (!path) {
    findings.add(head.extends_at, fmt::format("base profile '{}' is not found", head.extends));
    return std::nullopt;
  }
  const bool cycle = std::any_of(chain.begin(), chain.end(),
                                 [&](const Layer* layer) { return same_file(layer->path, *path); });
  if (cycle || chain.size() == deepest_chain) {
    findings.add(head.extends_at,
                 cycle ? fmt::format("'{}' extends itself in the end", head.extends)
                       : fmt::format("more than {} profiles extend each other", deepest_chain));
    return std::nullopt;
  }
  return path;
}

Result<Chain> read_chain(const std::string& path, Documents documents,
                         const std::vector<std::string>& folders, const ReadText& read,
                         Library& library, Findings& findings) {
  Chain chain;
  std::optional<std::string> next = path;
  while (next) {
    auto layer = read_layer(*next, documents, read, library, findings);
    if (!layer) return tl::unexpected(std::move(layer.error()));
    chain.push_back(*layer);
    next = next_of(chain, folders, findings);
  }
  return chain;
}

/// How much is asked of a profile: what it needs to be used, or to be called good.
enum class Strictness : std::uint8_t { load, check };

ProfileDraft build(const Chain& chain, Strictness strictness, Findings& findings) {
  ProfileDraft draft;
  const std::string& missing_base = chain.back()->head.extends;
  draft.incomplete = !missing_base.empty();
  draft.profile.path = chain.front()->path;
  for (const Layer* layer : chain) {
    if (!layer->head.extends.empty()) draft.profile.bases.push_back(layer->head.extends);
  }
  for (auto layer = chain.rbegin(); layer != chain.rend(); ++layer) {
    if ((*layer)->documents.empty()) continue;
    read_profile((*layer)->documents.front(), draft, findings);
  }
  if (draft.top.entry == nullptr) return draft;  // not a document could be read
  const bool whole = !draft.incomplete && !chain.front()->head.abstract;
  if (whole && draft.link.entry == nullptr) {
    findings.add(draft.top.entry->at, "key 'link' is missing");
  }
  // On what is half read, rules would find faults that are none.
  draft.leave_out_half_read();
  check_rules(draft, findings);
  if (strictness == Strictness::check) check_guards(draft, findings);
  return draft;
}

catalogue::CodeTables collect_texts(const Chain& chain, Findings& findings) {
  catalogue::CodeTables codes;
  for (auto layer = chain.rbegin(); layer != chain.rend(); ++layer) {
    if (const YamlNode* part = find_part((*layer)->documents, "texts", findings)) {
      read_texts(*part, codes, findings);
    }
  }
  return codes;
}

const YamlNode* nearest_simulation(const Chain& chain, Findings& findings) {
  for (const Layer* layer : chain) {
    if (const YamlNode* part = find_part(layer->documents, "simulation", findings)) return part;
  }
  return nullptr;
}

/// Every profile file by id; the first folder that has one wins.
std::map<std::string, std::string> profile_files(const std::vector<std::string>& folders) {
  std::map<std::string, std::string> found;
  for (const std::string& folder : folders) {
    std::error_code problem;
    for (auto file = std::filesystem::directory_iterator(folder, problem);
         !problem && file != std::filesystem::directory_iterator(); file.increment(problem)) {
      const std::filesystem::path& path = file->path();
      const std::string id = path.stem().string();
      if (path.extension() == extension && is_catalogue_name(id)) {
        found.try_emplace(id, in_folder(folder, id));
      }
    }
  }
  return found;
}

bool is_abstract(const std::string& path, const ReadText& read) {
  Library library;
  Findings findings;
  const auto layer = read_layer(path, Documents::first, read, library, findings);
  return layer && (*layer)->head.abstract;
}

std::vector<ProfileEntry> list_profiles(const std::vector<std::string>& folders,
                                        const ReadText& read) {
  std::vector<ProfileEntry> entries;
  for (auto& [id, path] : profile_files(folders)) {
    if (!is_abstract(path, read)) entries.push_back({id, path});
  }
  return entries;
}

Result<std::string> locate(std::string_view name_or_file, const std::vector<std::string>& folders,
                           const ReadText& read) {
  if (names_profile_file(name_or_file)) return std::string(name_or_file);
  if (is_catalogue_name(name_or_file)) {
    for (const std::string& folder : folders) {
      std::string path = in_folder(folder, name_or_file);
      if (may_be_file(path)) return path;
    }
  }
  std::vector<std::string> ids;
  for (const ProfileEntry& entry : list_profiles(folders, read)) ids.push_back(entry.id);
  std::string hint = suggestion(name_or_file, ids);
  if (hint.empty()) hint = "'spindle profile list' shows those that exist";
  return tl::unexpected(Error{.code = Errc::unknown_name,
                              .message = "no such profile",
                              .hint = std::move(hint),
                              .name = std::string(name_or_file)});
}

/// A profile's files, read, with what was found wrong in them so far.
struct OpenChain {
  explicit OpenChain(std::string file) : path(std::move(file)) {}
  // A copy would point into the library of the first one.
  OpenChain(const OpenChain&) = delete;
  OpenChain& operator=(const OpenChain&) = delete;
  OpenChain(OpenChain&&) = default;
  OpenChain& operator=(OpenChain&&) = default;
  ~OpenChain() = default;

  std::string path;
  Library library;
  Chain chain;  ///< points into the library
  Findings findings;

  /// Error `bad_file` as soon as anything is wrong.
  [[nodiscard]] Result<void> check() const {
    if (findings.empty()) return {};
    Error error = findings.error();
    error.hint = fmt::format("{} lists every fault",
                             shown_command("spindle profile check " + shell_word(path)));
    return tl::unexpected(std::move(error));
  }
};

Result<OpenChain> open_chain(std::string_view name_or_file, Documents documents,
                             const std::vector<std::string>& folders, const ReadText& read) {
  auto path = locate(name_or_file, folders, read);
  if (!path) return tl::unexpected(std::move(path.error()));
  OpenChain open(std::move(*path));
  auto chain = read_chain(open.path, documents, folders, read, open.library, open.findings);
  if (!chain) return tl::unexpected(std::move(chain.error()));
  open.chain = std::move(*chain);
  return open;
}

}  // namespace

bool names_profile_file(std::string_view text) {
  return text.find('/') != std::string_view::npos || text.ends_with(extension);
}

Result<Profile> ProfileStore::load(std::string_view name_or_file) const {
  auto open = open_chain(name_or_file, Documents::first, folders_, read_);
  if (!open) return tl::unexpected(std::move(open.error()));
  Profile profile = build(open->chain, Strictness::load, open->findings).profile;
  if (auto sound = open->check(); !sound) return tl::unexpected(std::move(sound.error()));
  if (open->chain.front()->head.abstract) {
    return tl::unexpected(Error{.code = Errc::bad_file,
                                .message = "is only a base for other profiles",
                                .hint = "'spindle profile list' shows those of products",
                                .name = std::string(name_or_file)});
  }
  return profile;
}

Result<catalogue::SimulationFacts> ProfileStore::load_simulation(
    std::string_view name_or_file) const {
  auto open = open_chain(name_or_file, Documents::all, folders_, read_);
  if (!open) return tl::unexpected(std::move(open.error()));
  const YamlNode* part = nearest_simulation(open->chain, open->findings);
  catalogue::SimulationFacts facts;
  if (part != nullptr) facts = read_simulation(*part, open->findings);
  if (auto sound = open->check(); !sound) return tl::unexpected(std::move(sound.error()));
  return facts;
}

Result<catalogue::CodeTexts> ProfileStore::load_error_codes(std::string_view name_or_file) const {
  return load_code_tables(name_or_file).map([](catalogue::CodeTables tables) {
    return std::move(tables.error);
  });
}

Result<catalogue::CodeTables> ProfileStore::load_code_tables(std::string_view name_or_file) const {
  auto open = open_chain(name_or_file, Documents::all, folders_, read_);
  if (!open) return tl::unexpected(std::move(open.error()));
  catalogue::CodeTables codes = collect_texts(open->chain, open->findings);
  if (auto sound = open->check(); !sound) return tl::unexpected(std::move(sound.error()));
  return codes;
}

Result<std::vector<Finding>> ProfileStore::check(std::string_view name_or_file) const {
  auto open = open_chain(name_or_file, Documents::all, folders_, read_);
  if (!open) return tl::unexpected(std::move(open.error()));
  const ProfileDraft draft = build(open->chain, Strictness::check, open->findings);
  collect_texts(open->chain, open->findings);
  if (const YamlNode* part = nearest_simulation(open->chain, open->findings)) {
    read_simulation(*part, open->findings);
    // Its patterns may mean what could not be read.
    const bool known = !draft.incomplete && draft.half_read.empty();
    if (known) check_simulation(draft.profile, *part, open->findings);
  }
  return open->findings.list();
}

std::vector<ProfileEntry> ProfileStore::list() const { return list_profiles(folders_, read_); }

std::vector<Profile> ProfileStore::load_all() const {
  std::vector<Profile> profiles;
  Library library;
  for (const auto& [id, path] : profile_files(folders_)) {
    Findings findings;
    const auto chain = read_chain(path, Documents::first, folders_, read_, library, findings);
    if (!chain || chain->front()->head.abstract) continue;
    Profile profile = build(*chain, Strictness::load, findings).profile;
    if (findings.empty()) profiles.push_back(std::move(profile));
  }
  return profiles;
}

}  // namespace spindle::files
