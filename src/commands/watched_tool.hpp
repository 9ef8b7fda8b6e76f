#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/device/watcher.hpp"
#include "spindle/work/connect.hpp"

namespace spindle::commands {

/// A profile with the texts of its tools' error codes.
struct KnownProfile {
  catalogue::Profile profile;
  catalogue::CodeTables tables;
};

/// Profiles, each loaded once however many tools have it. Several threads may ask.
class ProfileShelf {
 public:
  explicit ProfileShelf(const files::ProfileStore& store) : store_(&store) {}

  /// Stays valid as long as the shelf.
  Result<const KnownProfile*> take(const std::string& id);

  /// What is known of a tool that says nothing of itself: registers without names.
  [[nodiscard]] const KnownProfile* nameless() const { return &nameless_; }

 private:
  const files::ProfileStore* store_;
  std::mutex mutex_;
  std::map<std::string, std::unique_ptr<const KnownProfile>> profiles_;
  const KnownProfile nameless_ = {};
};

/// A tool that is opened again and again. Where its profile is not known, it is asked at the first
/// time, so that a tool that is not there keeps no tool from being watched.
class WatchedTool {
 public:
  /// Loads the profile of a target that names one. `names` are the values that are wanted: raw
  /// registers alone need no profile. `names`, `shelf` and `context` must outlive it.
  static Result<WatchedTool> make(Target target, const std::vector<std::string>& names,
                                  ProfileShelf& shelf, const Context& context);

  [[nodiscard]] const Target& target() const { return target_; }
  /// Null until the tool has said what it is.
  [[nodiscard]] const KnownProfile* known() const { return known_; }

  /// Opens the tool and makes sure that its registers are those of the profile. Connecting takes no
  /// longer than `patience`.
  Result<device::Watcher::Link> open(Duration patience,
                                     const device::OpenTransport& open_transport);

 private:
  WatchedTool(Target target, const std::vector<std::string>& names, ProfileShelf& shelf,
              const Context& context)
      : target_(std::move(target)), names_(&names), shelf_(&shelf), context_(&context) {}

  void tell_other_serial(const device::Device& device);
  Result<void> find_profile(const Context& context);
  Result<void> do_without_profile(Error why, const Context& context);
  Result<void> adopt_profile(const std::string& profile);

  Target target_;
  const std::vector<std::string>* names_;
  ProfileShelf* shelf_;
  const Context* context_;
  const KnownProfile* known_ = nullptr;
  bool serial_is_checked_ = false;
  link::SessionOptions::LateAnswers late_answers_ = link::SessionOptions::LateAnswers::none;
};

/// The tools of these targets, none of which is asked. Those of one line have the same settings.
/// All but `targets` must outlive the tools.
Result<std::vector<WatchedTool>> prepare_tools(const std::vector<Target>& targets,
                                               const std::vector<std::string>& names,
                                               ProfileShelf& shelf, const Context& context);

/// Calls `handle` for every tool, each in a thread of its own when there are several, and returns
/// when all are done.
template <typename Handle>
void for_each_side_by_side(std::vector<WatchedTool>& tools, Handle handle) {
  if (tools.size() == 1) return handle(tools.front());
  std::vector<std::jthread> threads;
  threads.reserve(tools.size());
  for (WatchedTool& tool : tools) threads.emplace_back([&] { handle(tool); });
}

}  // namespace spindle::commands
