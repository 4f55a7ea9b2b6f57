//! Factors by number, in pages. Numbers are never reused, and most factors are removed in the order of their
//! insertion. A page without factors takes eight bytes.
use super::Factor;

const PAGE_SIZE: usize = 256;

#[derive(Default)]
struct Page {
    factors: Vec<Option<Factor>>,
    len: usize,
}

/// All present factors.
#[derive(Default)]
pub(super) struct Factors {
    pages: Vec<Option<Box<Page>>>,
    /// Number of the next new factor.
    pub(super) next: u32,
}

impl Factors {
    pub(super) fn get(&self, number: u32) -> Option<&Factor> {
        let page = self.pages.get(number as usize / PAGE_SIZE)?.as_ref()?;
        page.factors.get(number as usize % PAGE_SIZE)?.as_ref()
    }

    pub(super) fn get_mut(&mut self, number: u32) -> Option<&mut Factor> {
        let page = self.pages.get_mut(number as usize / PAGE_SIZE)?.as_mut()?;
        page.factors.get_mut(number as usize % PAGE_SIZE)?.as_mut()
    }

    /// Inserts a factor under an unused number.
    pub(super) fn insert(&mut self, number: u32, factor: Factor) {
        let (page, place) = (number as usize / PAGE_SIZE, number as usize % PAGE_SIZE);
        if self.pages.len() <= page {
            self.pages.resize_with(page + 1, || None);
        }
        let page = self.pages[page].get_or_insert_default();
        if page.factors.len() <= place {
            page.factors.resize_with(place + 1, || None);
        }
        page.len += usize::from(page.factors[place].is_none());
        page.factors[place] = Some(factor);
        self.next = self.next.max(number + 1);
    }

    pub(super) fn remove(&mut self, number: u32) -> Option<Factor> {
        let slot = self.pages.get_mut(number as usize / PAGE_SIZE)?;
        let page = slot.as_mut()?;
        let factor = page.factors.get_mut(number as usize % PAGE_SIZE)?.take()?;
        page.len -= 1;
        if page.len == 0 {
            *slot = None;
        }
        Some(factor)
    }

    /// Returns all factors, by ascending number.
    pub(super) fn iter(&self) -> impl Iterator<Item = (u32, &Factor)> {
        self.pages.iter().enumerate().flat_map(|(p, page)| {
            page.iter()
                .flat_map(|page| page.factors.iter().enumerate())
                .filter_map(move |(i, factor)| Some(((p * PAGE_SIZE + i) as u32, factor.as_ref()?)))
        })
    }
}
