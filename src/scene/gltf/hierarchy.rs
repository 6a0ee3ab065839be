//! The order of the file's nodes, and which of them belong to the scene that is shown.

use super::{Document, Read, clean_name, find_named, get};

/// Deeper hierarchies are refused: paths and chains of joints grow with the depth.
const MAX_DEPTH: usize = 1024;

/// The file's nodes in an order that has parents before children, depth first.
pub(super) struct Order {
    /// File index of each node of the scene.
    pub sources: Vec<usize>,
    /// Scene index of each node of the file.
    pub of_source: Vec<usize>,
    pub parents: Vec<Option<usize>>,
    /// Whether the node belongs to the scene that is shown.
    pub shown: Vec<bool>,
}

pub(super) fn order(document: &Document) -> Read<Order> {
    let root = &document.root;
    let count = root.nodes.len();
    let mut parent = vec![None; count];
    for (i, node) in root.nodes.iter().enumerate() {
        for child in node.children.iter().flatten() {
            let known =
                get(&root.nodes, *child, "node").map_err(|e| format!("a child of node {i}: {e}"));
            if document.geometry(known).is_none() {
                continue;
            }
            match &mut parent[child.value()] {
                none @ None => *none = Some(i),
                Some(first) => document.warn(format!(
                    "node {} has two parents; it was placed under node {first} alone",
                    child.value()
                )),
            }
        }
    }
    cut_cycles(document, &mut parent);
    let mut is_shown_root = vec![false; count];
    for node in shown_roots(document, &parent)? {
        is_shown_root[node] = true;
    }
    let mut order = Order {
        sources: Vec::with_capacity(count),
        of_source: vec![usize::MAX; count],
        parents: Vec::with_capacity(count),
        shown: Vec::with_capacity(count),
    };
    for start in (0..count).filter(|i| parent[*i].is_none()) {
        let mut stack = vec![(start, None, 0)];
        while let Some((source, above, depth)) = stack.pop() {
            // A child that is named twice.
            if order.of_source[source] != usize::MAX {
                continue;
            }
            if depth > MAX_DEPTH {
                return Err(format!("its nodes are nested deeper than {MAX_DEPTH}"));
            }
            let here = order.sources.len();
            order.sources.push(source);
            order.of_source[source] = here;
            order.parents.push(above);
            let shown = is_shown_root[source] || above.is_some_and(|a: usize| order.shown[a]);
            order.shown.push(shown);
            let children = root.nodes[source].children.iter().flatten().rev();
            let own = children
                .map(|c| c.value())
                .filter(|c| parent.get(*c) == Some(&Some(source)));
            stack.extend(own.map(|c| (c, Some(here), depth + 1)));
        }
    }
    Ok(order)
}

/// Takes the parent from one node of each cycle.
fn cut_cycles(document: &Document, parent: &mut [Option<usize>]) {
    // The walk towards the root that came by a node first.
    let mut walk = vec![None; parent.len()];
    for start in 0..parent.len() {
        let mut node = start;
        while walk[node].is_none() {
            walk[node] = Some(start);
            let Some(above) = parent[node] else { break };
            if walk[above] == Some(start) {
                document.warn(format!(
                    "node {node} is its own ancestor; it was placed at the root"
                ));
                parent[node] = None;
                break;
            }
            node = above;
        }
    }
}

/// The roots of the glTF scene that is shown.
fn shown_roots(document: &Document, parent: &[Option<usize>]) -> Read<Vec<usize>> {
    let root = &document.root;
    let scenes = &root.scenes;
    let label = |i: usize| match &scenes[i].name {
        Some(name) if !name.is_empty() => format!("scene {i} ({})", clean_name(Some(name), "", 0)),
        _ => format!("scene {i}"),
    };
    let roots_of = |i: usize| -> Vec<usize> {
        let known = scenes[i].nodes.iter().filter_map(|n| {
            let node = get(&root.nodes, *n, "node").map(|_| n.value());
            document.geometry(node.map_err(|e| format!("a node of {}: {e}", label(i))))
        });
        known.collect()
    };
    if let Some(wanted) = &document.options.scene {
        let names: Vec<String> = (0..scenes.len())
            .map(|i| clean_name(scenes[i].name.as_ref(), "scene ", i))
            .collect();
        return Ok(roots_of(find_named(wanted, &names, "scene")?));
    }
    let all_roots = || (0..parent.len()).filter(|i| parent[*i].is_none()).collect();
    if scenes.is_empty() {
        return Ok(all_roots());
    }
    let default = match root.scene {
        Some(scene) => {
            let known = get(scenes, scene, "scene").map(|_| scene.value());
            document.optional(known).unwrap_or(0)
        }
        None => 0,
    };
    let mut chosen = default;
    let mut roots = roots_of(chosen);
    if roots.is_empty() {
        // An empty default scene is of no use to anyone.
        let full = (0..scenes.len()).find(|i| !scenes[*i].nodes.is_empty());
        let Some(full) = full else {
            document.warn("no scene has nodes; all nodes of the file were taken".to_owned());
            return Ok(all_roots());
        };
        chosen = full;
        roots = roots_of(chosen);
        document.warn(format!(
            "{} has no nodes; {} of {} was taken",
            label(default),
            label(chosen),
            scenes.len()
        ));
    } else if scenes.len() > 1 {
        document.warn(format!(
            "{} of {} was taken; another is chosen by its number or name",
            label(chosen),
            scenes.len()
        ));
    }
    Ok(roots)
}
