/// What the smallest program costs: to be linked as spindle is, and compared with its start and
/// end.
int main() {}
