#include "spindle/device/run_model.hpp"

#include <fmt/format.h>

#include <utility>

#include "spindle/device/command_register.hpp"
#include "spindle/device/command_word.hpp"
#include "spindle/device/start_action.hpp"

namespace spindle::device {
namespace {

template <typename Model>
Result<std::unique_ptr<const RunModel>> make(const catalogue::Profile& profile) {
  return Model::of(profile).map([](Model&& model) -> std::unique_ptr<const RunModel> {
    return std::make_unique<const Model>(std::move(model));
  });
}

}  // namespace

Result<std::unique_ptr<const RunModel>> RunModel::of(const catalogue::Profile& profile) {
  if (!profile.run) {
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "the profile does not say how it is started and stopped by Modbus",
              .hint = "start and stop it at the tool",
              .name = profile.id});
  }
  switch (profile.run->kind()) {
    case catalogue::RunKind::start_action:
      return make<StartAction>(profile);
    case catalogue::RunKind::command_word:
      return make<CommandWord>(profile);
    case catalogue::RunKind::command_register:
      break;
  }
  return make<CommandRegister>(profile);
}

bool has_motor(const catalogue::Profile& profile) {
  return profile.run && profile.run->kind() != catalogue::RunKind::start_action;
}

std::string still_runs_words(const catalogue::Profile& profile) {
  return profile.run ? profile.run->still_runs.to_string() : std::string();
}

}  // namespace spindle::device
