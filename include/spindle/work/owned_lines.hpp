#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "spindle/link/doors.hpp"
#include "spindle/link/shared_line.hpp"
#include "spindle/work/target.hpp"

namespace spindle::work {

/// The lines of tools that one program holds for long, and on which it lets other programs ask. A
/// line that another program holds is asked through that one, and becomes ours when that ends.
/// Must outlive what it opens.
class OwnedLines {
 public:
  using Note = std::function<void(const std::string& sentence)>;

  /// Opens nothing. Units of one line or gateway share it; a simulated tool has none. `note` tells
  /// why others cannot ask; by any thread.
  OwnedLines(const std::vector<Target>& targets, const Environment& environment, Note note);
  OwnedLines(const OwnedLines&) = delete;
  OwnedLines& operator=(const OwnedLines&) = delete;
  /// Programs that ask are told that this one ended.
  ~OwnedLines();

  /// Like `open` of the environment; each opens its share of the line.
  [[nodiscard]] device::OpenTransport opener();

  /// A tool that may come and go: as long as it is there its line is ours, also while nothing is
  /// connected. A line that no tool needs any more is closed, and others find it free.
  class Stay {
   public:
    /// `lines` must outlive it.
    Stay(OwnedLines& lines, const link::Endpoint& endpoint);
    Stay(const Stay&) = delete;
    Stay& operator=(const Stay&) = delete;
    ~Stay();

   private:
    OwnedLines* lines_;
    std::string key_;
  };

  /// From now on others can ask. It starts threads.
  void open_doors();

  /// The same for any program, in Modbus TCP, on the one line that there is. Returns the port.
  /// Errors: `usage` where there are several lines or none; those of link::Doors.
  Result<std::uint16_t> listen(const std::string& host, std::uint16_t port, link::Rights rights);

 private:
  struct Line {
    explicit Line(Clock& clock, link::Stays stays) : line(clock, stays) {}

    link::SharedLine line;
    std::size_t tools = 0;  ///< that came and did not go
    std::string door = {};  ///< name of the line, once it was opened
  };

  Line& add(const std::string& key, const link::Endpoint& endpoint);
  void come(const std::string& key, const link::Endpoint& endpoint);
  void go(const std::string& key);
  void announce(const std::string& name, Line& line);
  void open_door(Line& line);
  [[nodiscard]] Line* line_of(const link::Endpoint& endpoint);

  const Environment* environment_;
  Note note_;
  std::size_t unowned_ = 0;  ///< targets without a line of their own here
  std::mutex mutex_ = {};    ///< guards what follows, but not the lines themselves
  std::map<std::string, std::unique_ptr<Line>> lines_ = {};  ///< none is removed
  std::set<std::string> several_ = {};  ///< what is several tools that each have a connection
  bool is_noted_ = false;
  std::unique_ptr<link::Doors> doors_ = nullptr;
};

}  // namespace spindle::work
