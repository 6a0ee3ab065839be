fn main() -> std::process::ExitCode {
    dapple::cli::main()
}
