// The words of a line of text.
#pragma once

#include <algorithm>
#include <string_view>

namespace btms {

// Words between blanks, or what is between delimiters, blanks around it aside; between two delimiters may be nothing.
class Fields {
 public:
  // delimiter 0: blanks, of which a run counts as one.
  Fields(std::string_view line, char delimiter) : line_(line), delimiter_(delimiter) {}

  // False behind the last word.
  bool next(std::string_view& word) {
    if (delimiter_ == 0) {
      at_ = std::min(line_.find_first_not_of(kBlanks, at_), line_.size());
      if (at_ == line_.size()) return false;
    } else if (at_ > line_.size()) {
      return false;
    }
    const std::size_t end =
        std::min(delimiter_ == 0 ? line_.find_first_of(kBlanks, at_) : line_.find(delimiter_, at_), line_.size());
    word = trimmed(line_.substr(at_, end - at_));
    at_ = end + 1;
    return true;
  }

  static std::string_view trimmed(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
    return text.substr(0, text.find_last_not_of(kBlanks) + 1);
  }

 private:
  static constexpr std::string_view kBlanks = " \t\r";
  std::string_view line_;
  char delimiter_;
  std::size_t at_ = 0;
};

}  // namespace btms
