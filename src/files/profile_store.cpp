#include "spindle/files/profile_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>

#include "files/profile_file.hpp"
#include "files/profile_rules.hpp"
#include "files/profile_run.hpp"
#include "spindle/base/text.hpp"

namespace spindle::files {
namespace {

using catalogue::Profile;

constexpr std::string_view extension = ".yaml";

/// Ours have two layers; a user's own makes three.
constexpr std::size_t deepest_chain = 8;

std::string in_folder(const std::string& folder, std::string_view id) {
  std::string path;
  path.reserve(folder.size() + id.size() + extension.size() + 1);
  path.append(folder).append("/").append(id).append(extension);
  return path;
}

/// The name of a file without its folder and its last extension.
std::string_view stem_of(std::string_view path) {
  const std::string_view name = path.substr(path.rfind('/') + 1);
  const std::size_t dot = name.rfind('.');
  return dot == 0 ? name : name.substr(0, dot);
}

std::string folder_of(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string_view::npos) return ".";
  const std::size_t last = path.find_last_not_of('/', slash);
  return last == std::string_view::npos ? "/" : std::string(path.substr(0, last + 1));
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
struct Chain {
  std::vector<const Layer*> layers = {};
  /// What the last of the files extends, where that is part of the program.
  const ShippedProfile* root = nullptr;
  /// Stands for all that the root says: findings about it are told where it is extended.
  YamlNode root_node = {};

  [[nodiscard]] const Layer& front() const { return *layers.front(); }
};

/// Where profiles are looked for, and what was found there: files are compared with the profiles of
/// the program once.
struct Places {
  std::vector<std::string> folders;
  Disk disk;
  ShippedProfiles shipped;
  mutable std::mutex mutex = {};  ///< of what was found
  mutable std::map<std::string, const ShippedProfile*> compared = {};
  mutable std::optional<std::vector<ProfileEntry>> listed = std::nullopt;
};

/// Whether profiles of the program are used where their files would say the same.
enum class Tables : std::uint8_t { used, not_used };

/// The file of a profile, in the first folder that has one. Where one may not look there may be
/// one: reading it says why not.
std::optional<std::string> locate_file(std::string_view id, const std::vector<std::string>& folders,
                                       const Disk& disk) {
  for (const std::string& folder : folders) {
    std::string path = in_folder(folder, id);
    if (!disk.absent(path)) return path;
  }
  return std::nullopt;
}

/// The base of a file: beside it, else in the store's folders.
std::optional<std::string> locate_base(const std::string& file, std::string_view id,
                                       const Places& places) {
  auto path = locate_file(id, {folder_of(file)}, places.disk);
  return path ? path : locate_file(id, places.folders, places.disk);
}

/// The profile of the program that was made from this file and from those that it extends; null
/// when there is none. A file that cannot be read is none of them: who needs it is told why.
const ShippedProfile* shipped_as(const std::string& path, const Places& places);

const ShippedProfile* compare(const std::string& path, const Places& places) {
  const ShippedProfile* shipped = find(places.shipped, stem_of(path));
  if (shipped == nullptr) return nullptr;
  const auto text = places.disk.read_trusted(path);
  if (!text || *text != shipped->yaml) return nullptr;
  if (shipped->extends.empty()) return shipped;
  const auto base = locate_base(path, shipped->extends, places);
  return !base || shipped_as(*base, places) != nullptr ? shipped : nullptr;
}

const ShippedProfile* shipped_as(const std::string& path, const Places& places) {
  {
    const std::lock_guard lock(places.mutex);
    if (const auto known = places.compared.find(path); known != places.compared.end()) {
      return known->second;
    }
  }
  const ShippedProfile* shipped = compare(path, places);
  const std::lock_guard lock(places.mutex);
  return places.compared.emplace(path, shipped).first->second;
}

Result<const Layer*> read_layer(const std::string& path, Documents documents, const Disk& disk,
                                Library& library, Diagnostics& findings) {
  if (const auto known = library.find(path); known != library.end()) {
    const bool sound = known->second.sound;
    if (!sound) findings.add({findings.add_file(path), 1, 1}, "the file has faults of its own");
    return &known->second;
  }
  TRY_LET(auto text, disk.read_trusted(path));
  Layer layer{.path = path, .file = findings.add_file(path), .documents = {}, .head = {}};
  layer.documents = parse_yaml(text, layer.file, documents, findings);
  if (!layer.documents.empty()) {
    layer.head = read_head(layer.documents.front(), findings);
  } else if (findings.empty()) {
    findings.add({layer.file, 1, 1}, "the file is empty");
  }
  layer.sound = findings.empty();
  return &library.emplace(path, std::move(layer)).first->second;
}

/// What a file extends.
struct Base {
  std::string path = {};                    ///< of a file
  const ShippedProfile* shipped = nullptr;  ///< or of the program
};

std::optional<Base> find_base(const Layer& layer, const Places& places, Tables tables) {
  const std::string& id = layer.head.extends;
  auto path = locate_base(layer.path, id, places);
  if (!path) {
    const ShippedProfile* shipped = find(places.shipped, id);
    return shipped == nullptr ? std::nullopt : std::optional(Base{.shipped = shipped});
  }
  Base base{.path = std::move(*path)};
  if (tables == Tables::used) base.shipped = shipped_as(base.path, places);
  return base;
}

/// The next one of the chain; empty at its end, or after a finding.
std::optional<Base> next_of(const Chain& chain, const Places& places, Tables tables,
                            Diagnostics& findings) {
  const Layer& last = *chain.layers.back();
  const ProfileHead& head = last.head;
  if (head.extends.empty()) return std::nullopt;
  if (!is_catalogue_name(head.extends)) {
    findings.add(head.extends_at, fmt::format("'{}' is no profile id", head.extends));
    return std::nullopt;
  }
  auto base = find_base(last, places, tables);
  if (!base) {
    findings.add(head.extends_at, fmt::format("base profile '{}' is not found", head.extends));
    return std::nullopt;
  }
  const bool cycle = !base->path.empty() &&
                     std::any_of(chain.layers.begin(), chain.layers.end(), [&](const Layer* layer) {
                       return places.disk.same_file(layer->path, base->path);
                     });
  if (cycle || chain.layers.size() == deepest_chain) {
    findings.add(head.extends_at,
                 cycle ? fmt::format("'{}' extends itself in the end", head.extends)
                       : fmt::format("more than {} profiles extend each other", deepest_chain));
    return std::nullopt;
  }
  return base;
}

Result<Chain> read_chain(const std::string& path, Documents documents, const Places& places,
                         Tables tables, Library& library, Diagnostics& findings) {
  Chain chain;
  std::optional<Base> next = Base{.path = path};
  while (next) {
    if (next->shipped != nullptr) {
      chain.root = next->shipped;
      chain.root_node.at = chain.layers.back()->head.extends_at;
      break;
    }
    TRY_LET(auto layer, read_layer(next->path, documents, places.disk, library, findings));
    chain.layers.push_back(layer);
    next = next_of(chain, places, tables, findings);
  }
  return chain;
}

/// How much is asked of a profile: what it needs to be used, or to be called good.
enum class Strictness : std::uint8_t { load, check };

ProfileDraft build(const Chain& chain, Strictness strictness, Diagnostics& findings) {
  ProfileDraft draft;
  std::vector<catalogue::Text> bases;
  for (const Layer* layer : chain.layers) {
    if (!layer->head.extends.empty()) bases.emplace_back(layer->head.extends);
  }
  if (chain.root != nullptr) {
    draft.begin_with(*chain.root->profile, chain.root_node);
    bases.insert(bases.end(), draft.profile.bases.begin(), draft.profile.bases.end());
  } else {
    draft.incomplete = !chain.layers.back()->head.extends.empty();
  }
  draft.profile.path = chain.front().path;
  draft.profile.bases = std::move(bases);
  for (auto layer = chain.layers.rbegin(); layer != chain.layers.rend(); ++layer) {
    if ((*layer)->documents.empty()) continue;
    read_profile((*layer)->documents.front(), draft, findings);
  }
  if (draft.top.entry == nullptr) return draft;  // not a document could be read
  const bool whole = !draft.incomplete && !chain.front().head.abstract;
  if (whole && draft.link.entry == nullptr) {
    findings.add(draft.top.entry->at, "key 'link' is missing");
  }
  // On what is half read, rules would find faults that are none.
  draft.finish();
  check_rules(draft, findings);
  derive_run(draft);
  if (strictness == Strictness::check) check_guards(draft, findings);
  return draft;
}

catalogue::CodeTables collect_texts(const Chain& chain, Diagnostics& findings) {
  catalogue::CodeTables codes;
  if (chain.root != nullptr) codes = *chain.root->codes;
  for (auto layer = chain.layers.rbegin(); layer != chain.layers.rend(); ++layer) {
    if (const YamlNode* part = find_part((*layer)->documents, Part::texts, findings)) {
      read_texts(*part, codes, findings);
    }
  }
  return codes;
}

const YamlNode* nearest_simulation(const Chain& chain, Diagnostics& findings) {
  for (const Layer* layer : chain.layers) {
    if (const YamlNode* part = find_part(layer->documents, Part::simulation, findings)) return part;
  }
  return nullptr;
}

/// Every profile file by id; the first folder that has one wins.
std::map<std::string, std::string> profile_files(const Places& places) {
  std::map<std::string, std::string> found;
  for (const std::string& folder : places.folders) {
    for (const std::string& name : places.disk.list(folder)) {
      const std::string_view id = stem_of(name);
      if (!name.ends_with(extension) || !is_catalogue_name(id)) continue;
      found.try_emplace(std::string(id), in_folder(folder, id));
    }
  }
  return found;
}

bool is_abstract(const std::string& path, const Places& places) {
  if (const ShippedProfile* shipped = shipped_as(path, places)) return shipped->is_abstract;
  Library library;
  Diagnostics findings;
  const auto layer = read_layer(path, Documents::first, places.disk, library, findings);
  return layer && (*layer)->head.abstract;
}

std::vector<ProfileEntry> look_for_profiles(const Places& places) {
  std::map<std::string, std::string> files = profile_files(places);
  for (const ShippedProfile& shipped : places.shipped) {
    files.try_emplace(std::string(shipped.id), built_in);
  }
  std::vector<ProfileEntry> entries;
  for (auto& [id, path] : files) {
    const bool abstract =
        path == built_in ? find(places.shipped, id)->is_abstract : is_abstract(path, places);
    if (!abstract) entries.push_back({id, path});
  }
  return entries;
}

/// What was found once stays.
const std::vector<ProfileEntry>& list_profiles(const Places& places) {
  {
    const std::lock_guard lock(places.mutex);
    if (places.listed) return *places.listed;
  }
  std::vector<ProfileEntry> entries = look_for_profiles(places);
  const std::lock_guard lock(places.mutex);
  if (!places.listed) places.listed = std::move(entries);
  return *places.listed;
}

/// A profile's file, or the profile of the program.
struct Located {
  std::string path = {};                    ///< empty: only in the program
  const ShippedProfile* shipped = nullptr;  ///< null: the file says something else
};

Result<Located> locate(std::string_view name_or_file, const Places& places) {
  const auto file = [&](std::string path) {
    const ShippedProfile* shipped = shipped_as(path, places);
    return Located{std::move(path), shipped};
  };
  if (names_profile_file(name_or_file)) return file(std::string(name_or_file));
  if (is_catalogue_name(name_or_file)) {
    if (auto path = locate_file(name_or_file, places.folders, places.disk)) {
      return file(std::move(*path));
    }
    if (const ShippedProfile* shipped = find(places.shipped, name_or_file)) {
      return Located{{}, shipped};
    }
  }
  std::vector<std::string> ids;
  for (const ProfileEntry& entry : list_profiles(places)) ids.push_back(entry.id);
  std::string hint = suggestion(name_or_file, ids);
  if (hint.empty()) hint = "'spindle profile list' shows those that exist";
  return tl::unexpected(Error{.code = Errc::unknown_name,
                              .message = "no such profile",
                              .hint = std::move(hint),
                              .name = std::string(name_or_file),
                              .remedy = remedy_for(name_or_file, ids, "spindle profile list")});
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
  Diagnostics findings;

  /// Error `bad_file` as soon as anything is wrong.
  [[nodiscard]] Result<void> check() const {
    if (findings.empty()) return {};
    Error error = findings.error();
    error.remedy.right = "spindle profile check " + shell_word(path);
    error.hint = fmt::format("{} lists every fault", shown_command(error.remedy.right));
    return tl::unexpected(std::move(error));
  }
};

Result<OpenChain> open_chain(std::string path, Documents documents, const Places& places,
                             Tables tables) {
  OpenChain open(std::move(path));
  TRY_LET(auto chain,
          read_chain(open.path, documents, places, tables, open.library, open.findings));
  open.chain = std::move(chain);
  return open;
}

Error only_a_base(std::string_view name) {
  return {.code = Errc::bad_file,
          .message = "is only a base for other profiles",
          .hint = "'spindle profile list' shows those of products",
          .name = std::string(name),
          .remedy = {.right = "spindle profile list"}};
}

Result<AnyProfile> load_file(const std::string& path, const Places& places) {
  TRY_LET(auto open, open_chain(path, Documents::first, places, Tables::used));
  Profile profile = build(open.chain, Strictness::load, open.findings).profile;
  TRY(open.check());
  return AnyProfile{std::move(profile), open.chain.front().head.abstract};
}

Result<catalogue::SimulationSpec> load_simulation_of(const std::string& path,
                                                     const Places& places) {
  TRY_LET(auto open, open_chain(path, Documents::all, places, Tables::used));
  const YamlNode* part = nearest_simulation(open.chain, open.findings);
  catalogue::SimulationSpec facts;
  if (part != nullptr) {
    facts = read_simulation(*part, open.findings);
  } else if (open.chain.root != nullptr) {
    facts = *open.chain.root->simulation;
  }
  TRY(open.check());
  return facts;
}

Result<catalogue::CodeTables> load_codes_of(const std::string& path, const Places& places) {
  TRY_LET(auto open, open_chain(path, Documents::all, places, Tables::used));
  catalogue::CodeTables codes = collect_texts(open.chain, open.findings);
  TRY(open.check());
  return codes;
}

template <typename Made>
using Kept = std::map<std::string, Made, std::less<>>;

template <typename Made>
Made copy_of(const Made* kept) {
  return *kept;
}

}  // namespace

bool names_profile_file(std::string_view text) {
  return text.find('/') != std::string_view::npos || text.ends_with(extension);
}

const ShippedProfile* find(ShippedProfiles shipped, std::string_view id) {
  const auto found = std::lower_bound(
      shipped.begin(), shipped.end(), id,
      [](const ShippedProfile& one, std::string_view name) { return one.id < name; });
  return found == shipped.end() || found->id != id ? nullptr : &*found;
}

struct ProfileStore::Memory {
  Memory(std::vector<std::string> folders, Disk disk, ShippedProfiles shipped)
      : places{std::move(folders), std::move(disk), shipped} {}

  Places places;
  std::mutex mutex = {};
  // By the name that was asked for.
  Kept<AnyProfile> profiles = {};
  Kept<catalogue::SimulationSpec> simulations = {};
  Kept<catalogue::CodeTables> codes = {};

  /// What is kept under this name, else what `make(located)` makes, which is kept. It stays where
  /// it is.
  template <typename Made, typename Make>
  Result<const Made*> take(Kept<Made>& kept, std::string_view name, Make make) {
    const std::lock_guard lock(mutex);
    if (const auto known = kept.find(name); known != kept.end()) return &known->second;
    TRY_LET(auto located, locate(name, places));
    Result<Made> made = make(located);
    if (!made) return tl::unexpected(std::move(made.error()));
    return &kept.emplace(name, std::move(*made)).first->second;
  }

  Result<const AnyProfile*> profile(std::string_view name) {
    return take(profiles, name, [this](const Located& located) {
      if (located.shipped == nullptr) return load_file(located.path, places);
      Profile profile = *located.shipped->profile;
      profile.path = located.path.empty() ? std::string(located.shipped->id) : located.path;
      return Result<AnyProfile>(AnyProfile{std::move(profile), located.shipped->is_abstract});
    });
  }
};

ProfileStore::ProfileStore(std::vector<std::string> folders, Disk disk, ShippedProfiles shipped)
    : memory_(std::make_unique<Memory>(std::move(folders), std::move(disk), shipped)) {}
ProfileStore::ProfileStore(ProfileStore&&) noexcept = default;
ProfileStore& ProfileStore::operator=(ProfileStore&&) noexcept = default;
ProfileStore::~ProfileStore() = default;

Result<AnyProfile> ProfileStore::load_any(std::string_view name_or_file) const {
  return memory_->profile(name_or_file).map(copy_of<AnyProfile>);
}

Result<Profile> ProfileStore::load(std::string_view name_or_file) const {
  return memory_->profile(name_or_file).and_then([&](const AnyProfile* loaded) -> Result<Profile> {
    if (loaded->is_abstract) return tl::unexpected(only_a_base(name_or_file));
    return loaded->profile;
  });
}

Result<catalogue::SimulationSpec> ProfileStore::load_simulation(
    std::string_view name_or_file) const {
  const auto make = [&](const Located& located) {
    return located.shipped == nullptr ? load_simulation_of(located.path, memory_->places)
                                      : *located.shipped->simulation;
  };
  return memory_->take(memory_->simulations, name_or_file, make)
      .map(copy_of<catalogue::SimulationSpec>);
}

Result<catalogue::CodeTexts> ProfileStore::load_error_codes(std::string_view name_or_file) const {
  return load_code_tables(name_or_file).map([](catalogue::CodeTables tables) {
    return std::move(tables.error);
  });
}

Result<catalogue::CodeTables> ProfileStore::load_code_tables(std::string_view name_or_file) const {
  const auto make = [&](const Located& located) {
    return located.shipped == nullptr ? load_codes_of(located.path, memory_->places)
                                      : *located.shipped->codes;
  };
  return memory_->take(memory_->codes, name_or_file, make).map(copy_of<catalogue::CodeTables>);
}

Result<std::vector<Diagnostic>> ProfileStore::check(std::string_view name_or_file) const {
  TRY_LET(auto located, locate(name_or_file, memory_->places));
  if (located.path.empty())
    return std::vector<Diagnostic>();  // it was checked when it was built in
  TRY_LET(auto open, open_chain(located.path, Documents::all, memory_->places, Tables::not_used));
  const ProfileDraft draft = build(open.chain, Strictness::check, open.findings);
  collect_texts(open.chain, open.findings);
  if (const YamlNode* part = nearest_simulation(open.chain, open.findings)) {
    read_simulation(*part, open.findings);
    // Its patterns may mean what could not be read.
    const bool known = !draft.incomplete && draft.half_read.empty();
    if (known) check_simulation(draft.profile, *part, open.findings);
  }
  return open.findings.list();
}

std::vector<ProfileEntry> ProfileStore::list() const { return list_profiles(memory_->places); }

std::vector<Profile> ProfileStore::load_all() const {
  const std::vector<ProfileEntry>& entries = list_profiles(memory_->places);
  std::vector<Profile> profiles;
  profiles.reserve(entries.size());
  for (const ProfileEntry& entry : entries) {
    if (auto profile = load(entry.id)) profiles.push_back(std::move(*profile));
  }
  return profiles;
}

}  // namespace spindle::files
