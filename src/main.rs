fn main() -> std::process::ExitCode {
    // Mesa's drivers print an error about each missing XDG_RUNTIME_DIR, which only windows need.
    if std::env::var_os("XDG_RUNTIME_DIR").is_none_or(|dir| dir.is_empty()) {
        // SAFETY: no other thread exists yet that could read the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
    dapple::cli::main()
}
