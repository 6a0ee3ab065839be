//! Lists what a crate offers, from its sources.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use quote::ToTokens;
use syn::{Attribute, Fields, ImplItem, Item, Type, UseTree, Visibility};

/// The name that paths of the listing start with.
const NAME: &str = "dapple_codec";

/// Items of each module by its path within the crate, which is empty for the root.
pub type Crate = BTreeMap<String, Vec<Item>>;

/// Reads a crate from its root file.
pub fn read(root: &Path) -> Crate {
    let mut modules = Crate::new();
    let folder = root.parent().expect("a folder");
    read_module(root, folder, "", &mut modules);
    modules
}

fn read_module(file: &Path, folder: &Path, path: &str, modules: &mut Crate) {
    let text = std::fs::read_to_string(file)
        .unwrap_or_else(|error| panic!("{} cannot be read: {error}", file.display()));
    let parsed = syn::parse_file(&text)
        .unwrap_or_else(|error| panic!("{} cannot be parsed: {error}", file.display()));
    for item in &parsed.items {
        if let Item::Mod(module) = item
            && module.content.is_none()
            && !is_for_tests(&module.attrs)
        {
            let name = module.ident.to_string();
            let inside = folder.join(&name);
            let own = folder.join(format!("{name}.rs"));
            let file = if own.is_file() {
                own
            } else {
                inside.join("mod.rs")
            };
            read_module(&file, &inside, &join(path, &name), modules);
        }
    }
    modules.insert(path.to_string(), parsed.items);
}

/// One line for each thing that a caller can name or rely on, sorted.
pub fn listing(modules: &Crate) -> String {
    let mut modules = modules.clone();
    for (path, items) in modules.clone() {
        take_inline_modules(&path, &items, &mut modules);
    }
    let mut listing = Listing {
        modules: &modules,
        lines: BTreeSet::new(),
        types: BTreeMap::new(),
    };
    listing.module("", NAME);
    listing.impls();
    listing
        .lines
        .iter()
        .map(|line| format!("{line}\n"))
        .collect()
}

/// Modules with a body get an entry of their own, as those in files have.
fn take_inline_modules(path: &str, items: &[Item], modules: &mut Crate) {
    for item in items {
        if let Item::Mod(module) = item
            && let Some((_, content)) = &module.content
            && !is_for_tests(&module.attrs)
        {
            let inner = join(path, &module.ident.to_string());
            take_inline_modules(&inner, content, modules);
            modules.insert(inner, content.clone());
        }
    }
}

struct Listing<'c> {
    modules: &'c Crate,
    lines: BTreeSet<String>,
    /// Public types by the module of their definition and their name: the paths that lead to each.
    types: BTreeMap<(String, String), Vec<String>>,
}

impl Listing<'_> {
    fn line(&mut self, path: &str, text: &str) {
        self.lines.insert(format!("{path}: {text}"));
    }

    /// Lists a public module. `module` is its path within the crate, `path` as callers write it.
    fn module(&mut self, module: &str, path: &str) {
        let modules = self.modules;
        for item in modules.get(module).into_iter().flatten() {
            if let Item::Use(import) = item {
                if is_public(&import.vis) {
                    for (from, name, renamed) in leaves(&import.tree) {
                        let from = resolve(module, &from);
                        let Some((home, item)) = find(self.modules, &from, &name) else {
                            panic!("{path}: {name} comes from outside or was not found in {from}");
                        };
                        self.item(&home, item, &format!("{path}::{renamed}"));
                    }
                }
            } else if let Some((visibility, name)) = named(item)
                && is_public(visibility)
            {
                self.item(module, item, &format!("{path}::{name}"));
            }
        }
    }

    fn item(&mut self, module: &str, item: &Item, path: &str) {
        match item {
            Item::Mod(inner) => {
                self.line(path, &format!("pub mod {}", inner.ident));
                self.module(&join(module, &inner.ident.to_string()), path);
            }
            Item::Const(item) => self.line(path, text(item).trim_end_matches(';')),
            Item::Type(item) => self.line(path, text(item).trim_end_matches(';')),
            Item::Fn(item) => self.line(path, &format!("pub {}", text(&item.sig))),
            Item::Struct(item) => {
                self.attributes(path, &item.attrs, |attributes| {
                    let private = item.fields.iter().any(|field| !is_public(&field.vis));
                    let private = if private { ", with private fields" } else { "" };
                    let generics = text(&item.generics);
                    format!("{attributes}pub struct {}{generics}{private}", item.ident)
                });
                for (index, field) in item.fields.iter().enumerate() {
                    if is_public(&field.vis) {
                        let name = field.ident.as_ref();
                        let name = name.map_or(index.to_string(), ToString::to_string);
                        self.line(path, &format!("pub {name}: {}", text(&field.ty)));
                    }
                }
                self.type_is_at(module, &item.ident.to_string(), path);
            }
            Item::Enum(item) => {
                self.attributes(path, &item.attrs, |attributes| {
                    format!(
                        "{attributes}pub enum {}{}",
                        item.ident,
                        text(&item.generics)
                    )
                });
                for variant in &item.variants {
                    let fields = match &variant.fields {
                        Fields::Unit => String::new(),
                        Fields::Unnamed(fields) => {
                            let types: Vec<_> =
                                fields.unnamed.iter().map(|f| text(&f.ty)).collect();
                            format!("({})", types.join(", "))
                        }
                        Fields::Named(fields) => {
                            let field =
                                |f: &syn::Field| format!("{}: {}", text(&f.ident), text(&f.ty));
                            let fields: Vec<_> = fields.named.iter().map(field).collect();
                            format!(" {{ {} }}", fields.join(", "))
                        }
                    };
                    let value = variant.discriminant.as_ref();
                    let value = value.map_or(String::new(), |(_, e)| format!(" = {}", text(e)));
                    self.line(path, &format!("variant {}{fields}{value}", variant.ident));
                }
                self.type_is_at(module, &item.ident.to_string(), path);
            }
            _ => panic!("{path}: a kind of item that the listing does not know"),
        }
    }

    /// The line of a type with the attributes that callers notice, and one for each derived trait.
    fn attributes(&mut self, path: &str, all: &[Attribute], line: impl Fn(&str) -> String) {
        let mut kept = String::new();
        for attribute in all {
            let text = text(attribute);
            if let Some(traits) = text.strip_prefix("#[derive(") {
                for name in traits.trim_end_matches(")]").split(',') {
                    self.line(path, &format!("#[derive({})]", name.trim()));
                }
            } else if !attribute.path().is_ident("doc") {
                kept += &text;
                kept.push(' ');
            }
        }
        self.line(path, &line(&kept));
    }

    fn type_is_at(&mut self, module: &str, name: &str, path: &str) {
        let known = self.types.entry((module.to_string(), name.to_string()));
        known.or_default().push(path.to_string());
    }

    /// Methods, constants and traits of the public types.
    fn impls(&mut self) {
        let modules = self.modules;
        let items = modules
            .iter()
            .flat_map(|(module, items)| items.iter().map(move |item| (module, item)));
        for (module, item) in items {
            let Item::Impl(block) = item else { continue };
            let Type::Path(type_path) = &*block.self_ty else {
                continue;
            };
            let Some(name) = type_path.path.segments.last() else {
                continue;
            };
            let name = name.ident.to_string();
            let Some((home, _)) = find(modules, module, &name) else {
                continue;
            };
            let Some(paths) = self.types.get(&(home, name)) else {
                continue;
            };
            for path in paths.clone() {
                if let Some((name, _)) = &block.trait_ {
                    let (generics, name) = (text(&block.generics), text(name));
                    let own = text(&block.self_ty);
                    self.line(&path, &format!("impl{generics} {name} for {own}"));
                    continue;
                }
                for item in &block.items {
                    match item {
                        ImplItem::Fn(method) if is_public(&method.vis) => {
                            self.line(&path, &format!("pub {}", text(&method.sig)));
                        }
                        ImplItem::Const(value) if is_public(&value.vis) => {
                            let (name, kind) = (&value.ident, text(&value.ty));
                            self.line(&path, &format!("pub const {name}: {kind}"));
                        }
                        _ => {}
                    }
                }
            }
        }
    }
}

/// The definition of a name in a module, through imports.
fn find<'c>(modules: &'c Crate, module: &str, name: &str) -> Option<(String, &'c Item)> {
    let items = modules.get(module)?;
    let defined = items
        .iter()
        .find(|item| named(item).is_some_and(|(_, found)| found == name));
    if let Some(item) = defined {
        return Some((module.to_string(), item));
    }
    items.iter().find_map(|item| {
        let Item::Use(import) = item else { return None };
        let leaf = leaves(&import.tree)
            .into_iter()
            .find(|(.., renamed)| renamed == name);
        leaf.and_then(|(from, original, _)| find(modules, &resolve(module, &from), &original))
    })
}

fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let text = text(attribute);
        text.starts_with("#[cfg") && text.contains("test")
    })
}

/// Visibility and name of an item that has both.
fn named(item: &Item) -> Option<(&Visibility, String)> {
    let (visibility, name) = match item {
        Item::Const(item) => (&item.vis, &item.ident),
        Item::Enum(item) => (&item.vis, &item.ident),
        Item::Fn(item) => (&item.vis, &item.sig.ident),
        Item::Mod(item) => (&item.vis, &item.ident),
        Item::Static(item) => (&item.vis, &item.ident),
        Item::Struct(item) => (&item.vis, &item.ident),
        Item::Trait(item) => (&item.vis, &item.ident),
        Item::Type(item) => (&item.vis, &item.ident),
        Item::Union(item) => (&item.vis, &item.ident),
        _ => return None,
    };
    Some((visibility, name.to_string()))
}

/// What an import brings in: the path before the name, the name, and the name it gets here.
fn leaves(tree: &UseTree) -> Vec<(Vec<String>, String, String)> {
    match tree {
        UseTree::Path(path) => {
            let mut below = leaves(&path.tree);
            let segment = path.ident.to_string();
            below
                .iter_mut()
                .for_each(|(from, ..)| from.insert(0, segment.clone()));
            below
        }
        UseTree::Name(name) => vec![(Vec::new(), name.ident.to_string(), name.ident.to_string())],
        UseTree::Rename(name) => {
            vec![(Vec::new(), name.ident.to_string(), name.rename.to_string())]
        }
        UseTree::Group(group) => group.items.iter().flat_map(leaves).collect(),
        _ => Vec::new(),
    }
}

/// The module that a path of an import means.
fn resolve(module: &str, segments: &[String]) -> String {
    let mut path = module.to_string();
    for segment in segments {
        path = match segment.as_str() {
            "crate" => String::new(),
            "self" => path,
            "super" => path
                .rsplit_once("::")
                .map_or("", |(parent, _)| parent)
                .to_string(),
            name => join(&path, name),
        };
    }
    path
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() {
        name.to_string()
    } else {
        format!("{path}::{name}")
    }
}

/// Tokens with the usual spaces.
fn text(tokens: &impl ToTokens) -> String {
    let mut text = tokens.to_token_stream().to_string();
    for (from, to) in [
        (" :: ", "::"),
        (":: ", "::"),
        (" <", "<"),
        ("< ", "<"),
        (" >", ">"),
        (" ,", ","),
        (" :", ":"),
        (" ;", ";"),
        ("& ", "&"),
        ("# [", "#["),
        ("[ ", "["),
        (" ]", "]"),
        ("( ", "("),
        (" )", ")"),
        // What formatting and the callee's own business leave no trace of.
        (",)", ")"),
        ("(mut self", "(self"),
    ] {
        text = text.replace(from, to);
    }
    // A call's parenthesis, but not that of a tuple.
    let mut joined = String::new();
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        let after_name = joined
            .chars()
            .last()
            .is_some_and(|last| last.is_alphanumeric());
        if !(c == ' ' && after_name && rest.peek() == Some(&'(')) {
            joined.push(c);
        }
    }
    joined
}
