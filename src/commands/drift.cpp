#include "drift.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "driver.hpp"
#include "records.hpp"
#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

/// Why, in two words: "no answer" of `no_answer`.
std::string in_words(const Error& error, const std::string& backup, const Disk& disk) {
  const bool is_about_file = !backup.empty() && error.status() == ExitStatus::bad_file &&
                             (error.name == backup || error.message.starts_with(backup));
  if (is_about_file) return disk.absent(backup) ? "no backup" : "bad backup";
  std::string words(info(error.status()).name);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

}  // namespace

std::vector<report::Field> tell_serials(const Serials& serials, const Target& target,
                                        const Context& context) {
  const auto& [tool, backup, file] = serials;
  if (!tool.empty() && !backup.empty() && tool != backup) {
    context.renderer.note(fmt::format("warning: {}: serial number {} answers, and {} is of {}",
                                      target.shown, tool, file, backup));
  }
  return {{"serial", text_or_null(tool)}, {"backup_serial", text_or_null(backup)}};
}

void tell_not_compared(const Target& target, const Error& error, const std::string& backup,
                       Context& context) {
  Outcome outcome;
  outcome.fail(error);
  const auto told = tell({.counts = {{"different", report::Cell()},
                                     {"same", report::Cell()},
                                     {"state", std::string("failed")},
                                     {"code", std::string(info(error.status()).name)}},
                          .sentence = in_words(error, backup, context.disk),
                          .target = target.shown},
                         outcome, context);
  static_cast<void>(told);  // the error itself is told, too
}

Summary drift_summary(const std::vector<Result<DiffResult>>& done, std::size_t tools,
                      const std::vector<std::string>& extra) {
  DiffResult sum;
  std::size_t failed = 0;
  std::size_t differing = 0;
  for (const auto& one : done) {
    const bool has_failed = !one || one->outcome.failed() > 0;
    if (has_failed) ++failed;
    if (!one) continue;
    if (!has_failed && one->different > 0) ++differing;
    sum.different += one->different;
    sum.same += one->same;
  }
  Summary summary = diff_summary(sum, {});
  summary.counts.push_back({"tools_same", count(tools - failed - differing)});
  summary.counts.push_back({"tools_different", count(differing)});
  summary.counts.push_back({"tools_failed", count(failed)});
  summary.counts.push_back({"extra_files", extra});
  const std::string all = counted(tools, "tool");
  summary.sentence += fmt::format(" on {}", all);
  if (differing > 0) {
    summary.sentence +=
        fmt::format("; {} of {} {}", differing, all, differing == 1 ? "differs" : "differ");
  }
  summary.sentence += failed_in_words(failed, tools);
  return summary;
}

}  // namespace spindle::commands
