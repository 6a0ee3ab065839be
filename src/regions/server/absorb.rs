//! Very small regions become part of the neighbour that fits best (section 3).

use super::fit::{self, Centres};
use super::graph::{Link, Region};
use super::samples::RegionSamples;
use rayon::prelude::*;

/// A region that is no more, and the one that has its space.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Absorbed {
    pub name: String,
    pub by: String,
}

/// Absorbs every region of less than `volume` cubic metres that has a neighbour, the smallest first. The
/// box of the neighbour grows to hold both, and its samples are those of both.
///
/// The neighbour is the one whose fit to both together adds the least squared error.
pub fn absorb(
    regions: &mut Vec<Region>,
    samples: &mut Vec<RegionSamples>,
    links: &mut Vec<Link>,
    volume: f64,
    centres: Centres,
) -> Vec<Absorbed> {
    let mut absorbed = Vec::new();
    let mut gone = vec![false; regions.len()];
    loop {
        let small = (0..regions.len())
            .filter(|&i| !gone[i] && links.iter().any(|link| link.regions.contains(&i)))
            .map(|i| (size(&regions[i]), i))
            .filter(|(size, _)| *size < volume)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, small)) = small else {
            break;
        };
        let host = host(regions, samples, links, small, centres);
        regions[host].bounds = regions[host].bounds.union(&regions[small].bounds);
        let own = std::mem::take(&mut samples[small].samples);
        samples[host].samples.extend(own);
        let held_out = std::mem::take(&mut samples[small].held_out);
        samples[host].held_out.extend(held_out);
        absorbed.push(Absorbed {
            name: regions[small].name.clone(),
            by: regions[host].name.clone(),
        });
        gone[small] = true;
        for link in links.iter_mut() {
            let [a, b] = link.regions.map(|i| if i == small { host } else { i });
            link.regions = [a.min(b), a.max(b)];
        }
        links.retain(|link| link.regions[0] != link.regions[1]);
    }
    remove(regions, samples, links, &gone);
    absorbed
}

/// Removes the regions that have no valid sample, and gives their names.
pub fn drop_empty(
    regions: &mut Vec<Region>,
    samples: &mut Vec<RegionSamples>,
    links: &mut Vec<Link>,
) -> Vec<String> {
    let gone: Vec<bool> = samples.iter().map(|s| s.samples.is_empty()).collect();
    let named = regions.iter().zip(&gone).filter(|(_, gone)| **gone);
    let names = named.map(|(region, _)| region.name.clone()).collect();
    links.retain(|link| link.regions.iter().all(|i| !gone[*i]));
    remove(regions, samples, links, &gone);
    names
}

/// Removes regions to which no link leads.
fn remove(
    regions: &mut Vec<Region>,
    samples: &mut Vec<RegionSamples>,
    links: &mut [Link],
    gone: &[bool],
) {
    let numbers: Vec<usize> = gone
        .iter()
        .scan(0, |next, gone| {
            let number = *next;
            *next += usize::from(!gone);
            Some(number)
        })
        .collect();
    for link in links {
        link.regions = link.regions.map(|i| numbers[i]);
    }
    let mut keep = gone.iter();
    regions.retain(|_| keep.next() == Some(&false));
    let mut keep = gone.iter();
    samples.retain(|_| keep.next() == Some(&false));
}

fn size(region: &Region) -> f64 {
    (region.bounds.max - region.bounds.min)
        .as_dvec3()
        .to_array()
        .iter()
        .product()
}

/// The neighbour whose best model of both regions adds the least squared error to what its own has.
fn host(
    regions: &[Region],
    samples: &[RegionSamples],
    links: &[Link],
    small: usize,
    centres: Centres,
) -> usize {
    let mut neighbours: Vec<usize> = links
        .iter()
        .filter(|link| link.regions.contains(&small))
        .map(|link| link.regions[usize::from(link.regions[0] == small)])
        .collect();
    neighbours.sort_unstable();
    neighbours.dedup();
    let costs: Vec<f64> = neighbours
        .par_iter()
        .map(|&host| {
            let own = &samples[host];
            let mut both = own.clone();
            both.samples.extend_from_slice(&samples[small].samples);
            let bounds = regions[host].bounds.union(&regions[small].bounds);
            let error = |bounds, samples: &RegionSamples| {
                let (_, fitted) = fit::fit(bounds, samples, centres);
                let residual = fitted.last().map_or(0.0, |fitted| fitted.residual);
                residual * samples.samples.len() as f64
            };
            error(bounds, &both) - error(regions[host].bounds, own)
        })
        .collect();
    let best = (0..neighbours.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    best.map_or(small, |best| neighbours[best])
}
