#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "spindle/report/record.hpp"
#include "spindle/report/renderer.hpp"
#include "spindle/report/screen_lines.hpp"

namespace spindle::commands {

/// Where each tool of a watch stands: its link, what its last result said, and its counts, in a
/// line for each. Pure.
class WatchBoard {
 public:
  /// `columns` are those of the stream; what they show of a result is shown here, too.
  WatchBoard(std::vector<std::string> targets, const std::vector<report::Column>& columns);

  /// What a record of the stream says of its tool. `preset_key` is the field that also counts where
  /// the record is no result; may be empty.
  void note(const report::Record& record, const std::string& preset_key);

  /// At most so many lines; the last one says how many tools found no room.
  [[nodiscard]] std::vector<report::ScreenLine> lines(std::size_t most, std::size_t room,
                                                      report::Color color) const;

 private:
  struct Tool {
    std::string target = {};
    std::string link = "connecting";
    bool is_connected = false;
    std::map<std::string, report::Field> cells = {};  ///< of its last result, by key
    std::size_t ok = 0;
    std::size_t ng = 0;
  };

  Tool* find(const std::string& target);
  void note_link(const report::Record& record, Tool& tool) const;
  void note_cell(const report::Field& field, const report::Column& column, Tool& tool) const;
  [[nodiscard]] report::Record record_of(const Tool& tool) const;
  [[nodiscard]] std::string rest_in_words(std::size_t from) const;

  std::vector<Tool> tools_ = {};
  std::vector<report::Column> of_result_ = {};  ///< that are taken from the stream
  std::vector<report::Column> columns_ = {};    ///< of the board
  std::string with_unit_ = {};  ///< the column whose unit the next one of the stream says, by key
};

}  // namespace spindle::commands
